/* Files that the core reads: what an FMU carries, and other calibrations.
 *
 * Lines of text, then doubles. The lines: the format (in an FMU, with the hash of all that follows),
 * the GUID (for no FMU: the table's hash), the tire's name, how many variables and texts for the log
 * there are (the latter not in older files), then one line each: R, I, B or S for its type, p, i or
 * o for parameter, input or output, and its name; or the text. The doubles: samples of a frame, whether it is
 * buffered, sample rate, what stands for a missing value, then the calibration's table. Written by
 * tirelib.fmu.native. */
#ifndef TIRE_RESOURCES_H
#define TIRE_RESOURCES_H

#include "../core/calibration.h"
#include "../core/state.h"

typedef struct {
    char *memory; /* of all texts */
    const char *guid, *tire;
    size_t variables, remarks;
    const char **variable, **remark;
    double samples, buffered, rate, missing;
    double *table;
    size_t numbers;
} Resources;

/* Turn the URI of a folder (or a plain path) into a path; `path` holds strlen(uri) + 1 bytes. */
void path_of(const char *uri, char *path);

/* Read a file. Returns what is wrong with it, NULL if nothing is. */
const char *resources_read(Resources *resources, const char *path);
/* Whether what is wrong is that the file is not there. */
int resources_missing(const char *wrong);
void resources_free(Resources *resources);

#endif
