// A line on a terminal that says how far a rendering is: frames done, a bar, frames a second, the time that remains.
//
//   ▕██████████▏ 120/240  8.31 frames/s  0:14 left
//   ▕██████████▏ 45%  0:07 left                        of a single picture
//
// It goes to standard error, only where that is a terminal, and is redrawn at most ten times a second. Nothing of it
// stays.
#ifndef SCN_RUNTIME_PROGRESS_H
#define SCN_RUNTIME_PROGRESS_H

#include <stdbool.h>

typedef struct Progress {
    bool shown; // there is a terminal and nobody asked for quiet
    bool drawn; // something stands on the line
    int total;
    double start, last; // seconds
} Progress;

void progress_start(Progress *progress, int total, bool quiet);
void progress_say(Progress *progress, const char *text); // instead of the bar
void progress_step(Progress *progress, double done);     // `done` of the total, with the part of a frame that is begun
void progress_clear(Progress *progress); // empties the line, before something else is printed and at the end

double progress_seconds(void); // the clock it goes by

// The line for a state, without drawing it. Remaining time is that of the mean so far.
void progress_text(char *text, int size, double done, int total, double seconds, int columns);

#endif
