/* grblhal_test FOLDER: runs the tests with the blobs in this folder.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#include "check.h"

int main(int count, char **words)
{
    if (count != 2)
        return 2;
    read_blobs(words[1]);
    refused();
    probing();
    jogs();
#if N_AXIS == 6
    inputs();
    exact();
    feeds();
    transitions();
    events();
    kinematics_within();
#endif
    printf("grblHAL plugin with %d axes: everything holds\n", N_AXIS);
    return 0;
}
