#include "runtime/package.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "runtime/plan_tables.h"
#include "runtime/record.h"

#define MAGIC         "\x89SCNK\r\n\x1a"
#define HEADER_SIZE   48
#define ENTRY_SIZE    32
#define CHECKED_SIZE  40 // of the header: what is before its checksum
#define SECTION_LIMIT 64

#define TAG(a, b, c, d) ((uint32_t)(a) | (uint32_t)(b) << 8 | (uint32_t)(c) << 16 | (uint32_t)(d) << 24)
#define TAG_INFO        TAG('I', 'N', 'F', 'O')
#define TAG_PLAN        TAG('P', 'L', 'A', 'N')
#define TAG_MAPS        TAG('M', 'A', 'P', 'S')
#define TAG_KERN        TAG('K', 'E', 'R', 'N')
#define TAG_BINA        TAG('B', 'I', 'N', 'A')

typedef struct Section {
    uint32_t tag, reserved;
    uint64_t offset, size, checksum;
} Section;

typedef struct Header {
    const uint8_t *magic;
    uint32_t version, section_count;
    uint64_t size;
    const uint8_t *structure;
    uint64_t checksum;
} Header;

bool package_is(const uint8_t *bytes, size_t size)
{
    return size >= 5 && !memcmp(bytes, MAGIC, 5);
}

bool package_file(const char *path)
{
    uint8_t bytes[8];
    struct stat status;
    if (stat(path, &status) || !S_ISREG(status.st_mode)) return false; // what is read from a pipe is gone
    FILE *file = fopen(path, "rb");
    if (!file) return false;
    size_t size = fread(bytes, 1, sizeof bytes, file);
    fclose(file);
    return package_is(bytes, size);
}

void package_hash_structure(Package *package)
{
    XXH128_canonical_t structure;
    XXH128_canonicalFromHash(&structure, XXH3_128bits(package->kernel, package->kernel_length));
    memcpy(package->structure, structure.digest, 16);
}

// --- what the sections hold, in both directions

static void info_record(Record *r, Package *package)
{
    record_text(r, &package->version);
    record_text(r, &package->scene);
}

static void place_record(Record *r, PackagePlace *place)
{
    record_u32(r, &place->span.begin);
    record_u32(r, &place->span.end);
    record_u32(r, &place->line);
    record_u32(r, &place->column);
    record_text(r, &place->path);
}

static void maps_record(Record *r, Package *package)
{
    record_table(r, package->places, package->place_count, 20, place_record);
}

static void header_record(Record *r, Header *header)
{
    record_bytes(r, &header->magic, 8);
    record_u32(r, &header->version);
    record_u32(r, &header->section_count);
    record_u64(r, &header->size);
    record_bytes(r, &header->structure, 16);
    record_u64(r, &header->checksum);
}

static void section_record(Record *r, Section *section)
{
    record_u32(r, &section->tag);
    record_u32(r, &section->reserved);
    record_u64(r, &section->offset);
    record_u64(r, &section->size);
    record_u64(r, &section->checksum);
}

// --- writing

typedef struct Builder {
    Record out;
    Section sections[SECTION_LIMIT];
    uint32_t count;
} Builder;

static void begin_section(Builder *builder, uint32_t tag)
{
    record_align(&builder->out, 16);
    builder->sections[builder->count] = (Section){.tag = tag, .offset = builder->out.size};
}

static void end_section(Builder *builder)
{
    Section *section = &builder->sections[builder->count++];
    section->size = builder->out.size - section->offset;
}

static uint64_t header_checksum(const uint8_t *bytes, uint32_t section_count)
{
    XXH3_state_t *state = XXH3_createState();
    if (!state) abort(); // 600 bytes: as in arena_alloc(), nobody could go on
    XXH3_64bits_reset(state);
    XXH3_64bits_update(state, bytes, CHECKED_SIZE);
    XXH3_64bits_update(state, bytes + HEADER_SIZE, (size_t)section_count * ENTRY_SIZE);
    uint64_t hash = XXH3_64bits_digest(state);
    XXH3_freeState(state);
    return hash;
}

// Puts header and table into the room that was left for them.
static void put_header(Builder *builder, const uint8_t structure[16])
{
    uint8_t *bytes = builder->out.bytes;
    Record head = {.writing = true};
    Header header = {(const uint8_t *)MAGIC, PACKAGE_VERSION, builder->count, builder->out.size, structure, 0};
    header_record(&head, &header);
    for (uint32_t i = 0; i < builder->count; i++) {
        Section *section = &builder->sections[i];
        section->checksum = XXH3_64bits(bytes + section->offset, section->size);
        section_record(&head, section);
    }
    if (!head.bad) memcpy(bytes, head.bytes, head.size);
    builder->out.bad |= head.bad;
    record_release(&head);
    if (builder->out.bad) return;
    Record sum = {.writing = true};
    uint64_t checksum = header_checksum(bytes, builder->count);
    record_u64(&sum, &checksum);
    if (!sum.bad) memcpy(bytes + CHECKED_SIZE, sum.bytes, 8);
    builder->out.bad |= sum.bad;
    record_release(&sum);
}

uint8_t *package_encode(Package *package, size_t *size, Failure *failure)
{
    package_hash_structure(package);
    Builder builder = {.out.writing = true};
    Record *out = &builder.out;
    uint32_t binaries = package->binary_count < SECTION_LIMIT - 4 ? package->binary_count : SECTION_LIMIT - 4;
    for (size_t i = 0; i < HEADER_SIZE + (4 + binaries) * ENTRY_SIZE; i += 16) {
        static const uint8_t zeros[16];
        const uint8_t *bytes = zeros;
        record_bytes(out, &bytes, 16);
    }
    begin_section(&builder, TAG_INFO);
    info_record(out, package);
    end_section(&builder);
    begin_section(&builder, TAG_PLAN);
    plan_record(out, package->plan);
    end_section(&builder);
    begin_section(&builder, TAG_MAPS);
    maps_record(out, package);
    end_section(&builder);
    begin_section(&builder, TAG_KERN);
    const uint8_t *kernel = (const uint8_t *)package->kernel;
    record_bytes(out, &kernel, package->kernel_length);
    end_section(&builder);
    for (uint32_t i = 0; i < binaries; i++) {
        PackageBinary *binary = &package->binaries[i];
        begin_section(&builder, TAG_BINA);
        record_text(out, &binary->key);
        record_bytes(out, &binary->bytes, binary->size);
        end_section(&builder);
    }
    if (!out->bad) put_header(&builder, package->structure);
    if (out->bad) {
        record_release(out);
        fail(failure, "out of memory");
        return NULL;
    }
    *size = out->size;
    return out->bytes;
}

bool package_write(const char *path, Package *package, Unfinished *unfinished, Failure *failure)
{
    size_t size;
    uint8_t *bytes = package_encode(package, &size, failure);
    if (!bytes) return fail_prefix(failure, "cannot write %s", path);
    WholeFile file;
    bool ok = whole_open(&file, path, unfinished, failure);
    if (ok) {
        ok = whole_write(&file, bytes, size, failure);
        if (ok)
            ok = whole_finish(&file, failure);
        else
            whole_drop(&file);
    }
    free(bytes);
    return ok;
}

// --- reading

static bool read_header(Record *r, Header *header, Failure *failure)
{
    if (r->size < HEADER_SIZE) {
        if (r->size && !memcmp(r->bytes, MAGIC, r->size < 8 ? r->size : 8)) return fail(failure, "it is cut off");
        return fail(failure, "it is no package of scn");
    }
    header_record(r, header);
    if (memcmp(header->magic, MAGIC, 8)) {
        // What a transfer as text does to a package is worth another word.
        if (!memcmp(r->bytes + 1, "SCNK", 4)) return fail(failure, "it was changed by a transfer as text");
        return fail(failure, "it is no package of scn");
    }
    if (header->version > PACKAGE_VERSION)
        return fail(failure,
                    "its format is %u, newer than this scn, which reads %d: update scn, or build the package again",
                    header->version, PACKAGE_VERSION);
    if (header->version < PACKAGE_VERSION)
        return fail(failure, "its format is %u, older than that of this scn, %d: build the package again",
                    header->version, PACKAGE_VERSION);
    if (header->size > r->size)
        return fail(failure, "it is cut off: %zu bytes of %llu are there", r->size, (unsigned long long)header->size);
    if (header->size < r->size) return fail(failure, "there are bytes after its end");
    if (header->section_count > SECTION_LIMIT || HEADER_SIZE + (uint64_t)header->section_count * ENTRY_SIZE > r->size ||
        header->checksum != header_checksum(r->bytes, header->section_count))
        return fail(failure, "its header is damaged");
    return true;
}

static bool check_sections(const Record *r, const Section *sections, uint32_t count, Failure *failure)
{
    for (uint32_t i = 0; i < count; i++) {
        const Section *section = &sections[i];
        char name[5] = {(char)section->tag, (char)(section->tag >> 8), (char)(section->tag >> 16),
                        (char)(section->tag >> 24), 0};
        if (section->offset > r->size || section->size > r->size - section->offset)
            return fail(failure, "its section %s lies outside", name);
        if (XXH3_64bits(r->bytes + section->offset, section->size) != section->checksum)
            return fail(failure, "its section %s is damaged", name);
    }
    return true;
}

// The one section with a tag, or NULL where there is none or more than one.
static const Section *find_section(const Section *sections, uint32_t count, uint32_t tag)
{
    const Section *found = NULL;
    for (uint32_t i = 0; i < count; i++) {
        if (sections[i].tag != tag) continue;
        if (found) return NULL;
        found = &sections[i];
    }
    return found;
}

static Record open_section(Arena *arena, const Record *file, const Section *section)
{
    return (Record){.arena = arena, .bytes = file->bytes + section->offset, .size = section->size};
}

static bool read_binaries(Package *package, Arena *arena, const Record *file, const Section *sections, uint32_t count)
{
    package->binaries = arena_array(arena, PackageBinary, count);
    for (uint32_t i = 0; i < count; i++) {
        if (sections[i].tag != TAG_BINA) continue;
        Record r = open_section(arena, file, &sections[i]);
        PackageBinary *binary = &package->binaries[package->binary_count++];
        record_text(&r, &binary->key);
        binary->size = r.size - r.at;
        record_bytes(&r, &binary->bytes, binary->size);
        if (r.bad || !binary->key) return false;
    }
    return true;
}

static bool check_places(const Package *package)
{
    for (uint32_t i = 0; i < package->place_count; i++) {
        const PackagePlace *place = &package->places[i];
        if (!place->path) return false;
        if (i && (place->span.begin < place[-1].span.begin ||
                  (place->span.begin == place[-1].span.begin && place->span.end <= place[-1].span.end)))
            return false;
    }
    return true;
}

static bool read_sections(Package *package, Arena *arena, const Record *file, const Section *sections, uint32_t count,
                          Failure *failure)
{
    const Section *info = find_section(sections, count, TAG_INFO), *plan = find_section(sections, count, TAG_PLAN);
    const Section *maps = find_section(sections, count, TAG_MAPS), *kernel = find_section(sections, count, TAG_KERN);
    if (!info || !plan || !maps || !kernel) return fail(failure, "a section is missing, or there twice");

    Record r = open_section(arena, file, info);
    info_record(&r, package);
    if (r.bad || r.at != r.size || !package->version || !package->scene)
        return fail(failure, "its section INFO makes no sense");

    r = open_section(arena, file, plan);
    package->plan = arena_new(arena, Plan);
    plan_record(&r, package->plan);
    if (r.bad || r.at != r.size) return fail(failure, "its section PLAN makes no sense");
    if (!plan_check(package->plan, failure)) return false;

    r = open_section(arena, file, maps);
    maps_record(&r, package);
    if (r.bad || r.at != r.size || !check_places(package)) return fail(failure, "its section MAPS makes no sense");

    package->kernel = arena_text(arena, (const char *)file->bytes + kernel->offset, kernel->size);
    package->kernel_length = kernel->size;
    if (memchr(package->kernel, 0, kernel->size)) return fail(failure, "its section KERN is no text");
    return read_binaries(package, arena, file, sections, count) || fail(failure, "a binary makes no sense");
}

Package *package_decode(Arena *arena, const uint8_t *bytes, size_t size, Failure *failure)
{
    Record file = {.arena = arena, .bytes = (uint8_t *)(uintptr_t)bytes, .size = size};
    Header header;
    if (!read_header(&file, &header, failure)) return NULL;
    Section sections[SECTION_LIMIT];
    for (uint32_t i = 0; i < header.section_count; i++) section_record(&file, &sections[i]);
    if (!check_sections(&file, sections, header.section_count, failure)) return NULL;
    Package *package = arena_new(arena, Package);
    memcpy(package->structure, header.structure, 16);
    if (!read_sections(package, arena, &file, sections, header.section_count, failure)) return NULL;
    return package;
}

// --- places and binaries

static int compare_spans(const Span *a, const Span *b)
{
    if (a->begin != b->begin) return a->begin < b->begin ? -1 : 1;
    return a->end == b->end ? 0 : a->end < b->end ? -1 : 1;
}

static int compare_places(const void *a, const void *b)
{
    return compare_spans(&((const PackagePlace *)a)->span, &((const PackagePlace *)b)->span);
}

// A path below the folder of the main file, as seen from there; other paths as they are.
static const char *relative_path(const char *path, const char *beside)
{
    const char *slash = strrchr(beside, '/');
    size_t folder = slash ? (size_t)(slash - beside) + 1 : 0;
    return strncmp(path, beside, folder) ? path : path + folder;
}

// The file that the user named: the first that neither scn itself nor another file brought.
static const char *main_path(const Sources *sources)
{
    for (uint32_t i = 0; i < sources->count; i++) {
        const Source *source = sources->list[i];
        if (!source->prelude && !source->library && !source->included_at.end) return source->path;
    }
    return "";
}

void package_map_places(Package *package, Arena *arena, Sources *sources)
{
    const Plan *plan = package->plan;
    uint32_t count = plan->step_count + plan->object_count + plan->param_count, n = 0;
    for (uint32_t i = 0; i < plan->patch_count; i++) count += 1 + plan->patches[i].program->step_count;
    PackagePlace *places = arena_array(arena, PackagePlace, count);
    for (uint32_t i = 0; i < plan->step_count; i++) places[n++].span = plan->steps[i].span;
    for (uint32_t i = 0; i < plan->object_count; i++) places[n++].span = plan->objects[i].span;
    for (uint32_t i = 0; i < plan->param_count; i++) places[n++].span = plan->params[i].span;
    for (uint32_t i = 0; i < plan->patch_count; i++) {
        const Plan *program = plan->patches[i].program;
        places[n++].span = plan->patches[i].span;
        for (uint32_t k = 0; k < program->step_count; k++) places[n++].span = program->steps[k].span;
    }
    qsort(places, n, sizeof *places, compare_places);

    package->places = places;
    package->place_count = 0;
    for (uint32_t i = 0; i < n; i++) {
        if (!places[i].span.end || (i && !compare_spans(&places[i].span, &places[i - 1].span))) continue;
        Place place = source_place(sources, places[i].span.begin);
        if (!place.source) continue;
        places[package->place_count++] = (PackagePlace){
            .span = places[i].span,
            .path = relative_path(place.source->path, main_path(sources)),
            .line = place.line,
            .column = place.column,
        };
    }
}

const PackagePlace *package_place(const Package *package, Span span)
{
    uint32_t low = 0, high = package->place_count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        int order = compare_spans(&package->places[middle].span, &span);
        if (!order) return &package->places[middle];
        if (order < 0)
            low = middle + 1;
        else
            high = middle;
    }
    return NULL;
}

const PackageBinary *package_binary(const Package *package, const char *device_key)
{
    for (uint32_t i = 0; i < package->binary_count; i++)
        if (!strcmp(package->binaries[i].key, device_key)) return &package->binaries[i];
    return NULL;
}
