// Devices and programs: choosing, building, the cache, binaries that need no compiler. Without any OpenCL device the
// tests are skipped, but the message that says so is tested.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "runtime/device.h"
#include "runtime/file.h"
#include "runtime/program.h"

static const char source[] = "kernel void twice(global float *a)\n"
                             "{\n"
                             "    size_t i = get_global_id(0);\n"
                             "    a[i] *= 2;\n"
                             "}\n";
static ProgramDesc description = {.source = source, .length = sizeof source - 1};
static char cache[] = "/tmp/scn-cache-XXXXXX";
static Device *device;

static void needs_device(void)
{
    if (!device) skip();
}

// Runs the kernel once and says whether it did what it says.
static bool doubles(const Program *program)
{
    cl_int status;
    float values[4] = {1, 2, 3, 4.5f};
    cl_mem buffer = clCreateBuffer(device->context, CL_MEM_COPY_HOST_PTR, sizeof values, values, &status);
    cl_kernel kernel = clCreateKernel(program->cl, "twice", &status);
    if (status != CL_SUCCESS) return false;
    clSetKernelArg(kernel, 0, sizeof buffer, &buffer);
    size_t global = 4, local = 1;
    clEnqueueNDRangeKernel(device->queue, kernel, 1, NULL, &global, &local, 0, NULL, NULL);
    clEnqueueReadBuffer(device->queue, buffer, CL_TRUE, 0, sizeof values, values, 0, NULL, NULL);
    clReleaseKernel(kernel);
    clReleaseMemObject(buffer);
    return values[0] == 2 && values[3] == 9;
}

// The only entry of the cache, or "".
static const char *entry_path(void)
{
    static char path[600];
    path[0] = 0;
    char folder[256];
    snprintf(folder, sizeof folder, "%s/scn", cache);
    DIR *dir = opendir(folder);
    for (struct dirent *entry; dir && (entry = readdir(dir));)
        if (entry->d_name[0] != '.') snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
    if (dir) closedir(dir);
    return path;
}

static void choices_that_do_not_exist_are_told(void **state)
{
    needs_device();
    Failure failure = {0};
    assert_null(device_open(&(DeviceDesc){.choice = "999"}, &failure));
    assert_non_null(strstr(failure.text, "there is no device 999"));
    assert_null(device_open(&(DeviceDesc){.choice = "no such name"}, &failure));
    assert_non_null(strstr(failure.text, "scn devices"));
}

static void devices_are_chosen_by_kind_number_and_name(void **state)
{
    needs_device();
    DeviceInfo infos[8];
    int count = device_list(infos, 8, NULL);
    assert_true(count >= 1);
    Device *first = device_open(&(DeviceDesc){.choice = "0"}, NULL);
    assert_string_equal(first->info.name, infos[0].name);
    char part[8];
    snprintf(part, sizeof part, "%.5s", infos[0].name);
    for (char *c = part; *c; c++)
        if (*c >= 'a' && *c <= 'z') *c = (char)(*c - 32);
    Device *named = device_open(&(DeviceDesc){.choice = part, .width = 1}, NULL);
    assert_string_equal(named->info.name, infos[0].name);
    assert_int_equal(named->width, 1);
    char key[DEVICE_KEY_SIZE], other[DEVICE_KEY_SIZE];
    device_key(first, key);
    device_key(named, other);
    assert_string_not_equal(key, other); // binaries of another width are others
    device_close(first);
    device_close(named);
    device_close(NULL);
}

static void a_program_is_built_stored_and_found(void **state)
{
    needs_device();
    Failure failure = {0};
    Program *program = program_build(device, &description, &failure);
    if (!program) fail_msg("%s", failure.text);
    assert_int_equal(program->builds, 1);
    assert_true(doubles(program));
    assert_string_equal(entry_path(), ""); // building alone stores nothing
    if (!program_store(program, &failure)) fail_msg("%s", failure.text);
    assert_string_not_equal(entry_path(), "");
    program_free(program);

    program = program_build(device, &description, &failure);
    assert_int_equal(program->builds, 0);
    assert_true(program->from_cache);
    assert_true(doubles(program));
    program_free(program);

    ProgramDesc without = description;
    without.no_cache = true;
    program = program_build(device, &without, &failure);
    assert_int_equal(program->builds, 1);
    program_free(program);

    ProgramDesc other = description;
    other.options = "-cl-std=CL1.2";
    program = program_build(device, &other, &failure);
    assert_int_equal(program->builds, 1); // other options, other key
    program_free(program);
}

static void damaged_entries_are_built_again(void **state)
{
    needs_device();
    assert_string_not_equal(entry_path(), "");
    FileBytes whole;
    assert_true(bytes_open(&whole, entry_path(), NULL));
    // A byte changed, cut short, empty, another file.
    for (int damage = 0; damage < 4; damage++) {
        FILE *file = fopen(entry_path(), "wb");
        uint8_t *bytes = malloc(whole.size);
        memcpy(bytes, whole.bytes, whole.size);
        bytes[whole.size / 2] ^= 1;
        if (damage == 0) fwrite(bytes, 1, whole.size, file);
        if (damage == 1) fwrite(whole.bytes, 1, whole.size / 2, file);
        if (damage == 3) fputs("something else that is no entry of the cache at all", file);
        fclose(file);
        free(bytes);
        Program *program = program_build(device, &description, NULL);
        assert_non_null(program);
        assert_false(program->from_cache);
        assert_true(doubles(program));
        program_free(program);
    }
    Program *program = program_build(device, &description, NULL);
    assert_true(program_store(program, NULL)); // replaces it
    program_free(program);
    program = program_build(device, &description, NULL);
    assert_true(program->from_cache);
    program_free(program);
    bytes_close(&whole);
}

static void a_binary_needs_no_compiler(void **state)
{
    needs_device();
    ProgramDesc desc = description;
    desc.no_cache = true;
    Program *program = program_build(device, &desc, NULL);
    size_t size;
    void *binary = program_binary(program, &size, NULL);
    assert_non_null(binary);
    program_free(program);
    desc.binary = binary;
    desc.binary_size = size;
    program = program_build(device, &desc, NULL);
    assert_true(program->from_binary);
    assert_int_equal(program->builds, 0);
    assert_true(doubles(program));
    program_free(program);
    free(binary);

    desc.binary = "this is no binary";
    desc.binary_size = 17;
    program = program_build(device, &desc, NULL); // the source is built instead
    assert_non_null(program);
    assert_false(program->from_binary);
    program_free(program);
}

static void a_kernel_that_does_not_compile_is_an_internal_error(void **state)
{
    needs_device();
    static const char wrong[] = "kernel void broken(global float *a) { a[0] = missing_function(1); int x = }\n";
    Failure failure = {0};
    int quiet = dup(2); // the driver prints too
    assert_non_null(freopen("/dev/null", "w", stderr));
    assert_null(
        program_build(device, &(ProgramDesc){.source = wrong, .length = sizeof wrong - 1, .no_cache = true}, &failure));
    dup2(quiet, 2);
    close(quiet);
    assert_non_null(strstr(failure.text, "internal error"));
    const char *path = strstr(failure.text, "are in ");
    assert_non_null(path);
    FileBytes log;
    assert_true(bytes_open(&log, path + strlen("are in "), NULL));
    assert_non_null(memmem(log.bytes, log.size, "void broken", 11));
    bytes_close(&log);
    unlink(path + strlen("are in "));
}

// In a process of its own, which finds no driver.
static void a_machine_without_devices_is_told_what_to_install(void **state)
{
    int ends[2];
    assert_int_equal(pipe(ends), 0);
    pid_t child = fork();
    if (!child) {
        setenv("OCL_ICD_VENDORS", "/nonexistent/", 1);
        Failure failure = {0};
        Device *none = device_open(&(DeviceDesc){0}, &failure);
        ssize_t written = none ? 0 : write(ends[1], failure.text, strlen(failure.text));
        _exit(written > 0 ? 0 : 1);
    }
    close(ends[1]);
    char text[1024] = "";
    ssize_t length = read(ends[0], text, sizeof text - 1);
    close(ends[0]);
    int status;
    waitpid(child, &status, 0);
    assert_true(length > 0);
    assert_non_null(strstr(text, "pocl-opencl-icd"));
}

static void error_codes_have_names(void **state)
{
    assert_string_equal(device_error(CL_OUT_OF_RESOURCES), "CL_OUT_OF_RESOURCES");
    assert_string_equal(device_error(12345), "an unknown OpenCL error");
}

static int set_up(void **state)
{
    if (!mkdtemp(cache)) return 1;
    setenv("XDG_CACHE_HOME", cache, 1);
    setenv("POCL_CACHE_DIR", cache, 1);
    return 0;
}

static int open_device(void **state)
{
    if (!device) device = device_open(&(DeviceDesc){.choice = "cpu"}, NULL);
    return 0;
}

static int tear_down(void **state)
{
    device_close(device);
    char command[300];
    snprintf(command, sizeof command, "rm -r '%s'", cache);
    return system(command) ? 1 : 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_machine_without_devices_is_told_what_to_install), // first: the process has no driver yet
        cmocka_unit_test_setup(choices_that_do_not_exist_are_told, open_device),
        cmocka_unit_test(devices_are_chosen_by_kind_number_and_name),
        cmocka_unit_test(a_program_is_built_stored_and_found),
        cmocka_unit_test(damaged_entries_are_built_again),
        cmocka_unit_test(a_binary_needs_no_compiler),
        cmocka_unit_test(a_kernel_that_does_not_compile_is_an_internal_error),
        cmocka_unit_test(error_codes_have_names),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
