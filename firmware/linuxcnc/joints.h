/* SPDX-License-Identifier: MIT
 *
 * Parameters of the lines that load the components: letters of joints, and units.
 */
#ifndef JOINTS_H
#define JOINTS_H

#include <string.h>
#include <strings.h>

#define MOST_JOINTS 16

/* Length of a linear unit of the machine in mm, as named in [TRAJ]LINEAR_UNITS; 0 for any other word. */
static double mm_of(const char *unit)
{
    static const char *const METRIC[] = {"mm", "metric"}, *const INCHES[] = {"inch", "in", "imperial"};
    for (size_t k = 0; k < sizeof METRIC / sizeof *METRIC; k++)
        if (strcasecmp(unit, METRIC[k]) == 0)
            return 1.0;
    for (size_t k = 0; k < sizeof INCHES / sizeof *INCHES; k++)
        if (strcasecmp(unit, INCHES[k]) == 0)
            return 25.4;
    return 0.0;
}

/* The number of joints with these letters; 0 if the letters are invalid. */
static int joints_of(const char *letters)
{
    size_t joints = strlen(letters);
    return joints <= MOST_JOINTS && strspn(letters, "XYZABCUVW-") == joints ? (int)joints : 0;
}

#endif
