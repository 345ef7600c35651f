/* SPDX-License-Identifier: MIT
 *
 * Files, read whole. Not for a real-time thread.
 */
#ifndef FILE_H
#define FILE_H

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MOST_BYTES (64 * 1024 * 1024)

/* Reads a file into memory of its own, aligned to 16 bytes; on failure returns NULL and the reason in `why`. */
static void *read_file(const char *path, size_t *length, const char **why)
{
    FILE *from = fopen(path, "rb");
    long size = -1;
    void *bytes = NULL;
    if (from != NULL && fseek(from, 0, SEEK_END) == 0)
        size = ftell(from);
    if (size < 0 || size > MOST_BYTES || fseek(from, 0, SEEK_SET) != 0) {
        *why = size > MOST_BYTES ? "more than 64 MB" : strerror(errno);
    } else if ((bytes = malloc(size > 0 ? (size_t)size : 1)) == NULL ||
               fread(bytes, 1, (size_t)size, from) != (size_t)size) {
        *why = bytes == NULL ? "no memory" : "cannot be read";
        free(bytes);
        bytes = NULL;
    }
    if (from != NULL)
        fclose(from);
    *length = bytes != NULL ? (size_t)size : 0;
    return bytes;
}

#endif
