#include "runtime/progress.h"

#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

double progress_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

void progress_start(Progress *progress, int total, bool quiet)
{
    *progress = (Progress){.shown = !quiet && isatty(STDERR_FILENO), .total = total, .start = progress_seconds()};
}

static int columns_of_terminal(void)
{
    struct winsize size;
    return !ioctl(STDERR_FILENO, TIOCGWINSZ, &size) && size.ws_col ? size.ws_col : 80;
}

// "0:07", "12:03", "1:02:03"
static int put_time(char *text, int size, double seconds)
{
    long whole = (long)(seconds + 0.5);
    if (whole >= 3600)
        return snprintf(text, (size_t)size, "%ld:%02ld:%02ld", whole / 3600, whole / 60 % 60, whole % 60);
    return snprintf(text, (size_t)size, "%ld:%02ld", whole / 60, whole % 60);
}

// " 45%" of one picture, " 120/240  8.3 frames/s" of many. Returns the length.
static int put_done(char *text, int size, double done, int total, double rate)
{
    if (total == 1) return snprintf(text, (size_t)size, " %d%%", (int)(100 * done));
    int length = snprintf(text, (size_t)size, " %d/%d", (int)done, total);
    if (done < 1) return length;
    if (rate >= 1) return length + snprintf(text + length, (size_t)(size - length), "  %.1f frames/s", rate);
    return length + snprintf(text + length, (size_t)(size - length), "  %.1f s a frame", 1 / rate);
}

void progress_text(char *text, int size, double done, int total, double seconds, int columns)
{
    char numbers[96], remaining[32] = "";
    double rate = seconds > 0 ? done / seconds : 0;
    int length = put_done(numbers, sizeof numbers, done, total, rate);
    if (rate > 0 && done < total) {
        put_time(remaining, sizeof remaining, (total - done) / rate);
        snprintf(numbers + length, sizeof numbers - (size_t)length, "  %s left", remaining);
    }
    int bar = columns - 3 - (int)strlen(numbers);
    if (bar > 40) bar = 40;
    int at = 0, filled = total > 0 && bar > 0 ? (int)(bar * done / total) : 0;
    if (bar >= 5) {
        at += snprintf(text + at, (size_t)(size - at), "▕");
        for (int i = 0; i < bar && at < size - 16; i++)
            at += snprintf(text + at, (size_t)(size - at), "%s", i < filled ? "█" : " ");
        at += snprintf(text + at, (size_t)(size - at), "▏");
    }
    snprintf(text + at, (size_t)(size - at), "%s", numbers);
}

void progress_clear(Progress *progress)
{
    if (progress->drawn) fputs("\r\033[K", stderr);
    progress->drawn = false;
}

void progress_say(Progress *progress, const char *text)
{
    if (!progress->shown) return;
    fprintf(stderr, "\r\033[K%s", text);
    progress->drawn = true;
}

void progress_step(Progress *progress, double done)
{
    double now = progress_seconds();
    if (!progress->shown || (done < progress->total && now - progress->last < 0.1)) return;
    progress->last = now;
    char text[512];
    progress_text(text, sizeof text, done, progress->total, now - progress->start, columns_of_terminal());
    progress_say(progress, text);
}
