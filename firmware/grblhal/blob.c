/* SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#include "controller.h"
#include "blob.h"

#ifdef TRUEAXIS_FLASH

const void *txa_blob(size_t *length, const char **why)
{
    (void)why;
    *length = TRUEAXIS_FLASH_SIZE;
    return TRUEAXIS_FLASH;
}

#else

static uint32_t bytes[(TRUEAXIS_FILE_MOST + 3) / 4];

const void *txa_blob(size_t *length, const char **why)
{
    vfs_file_t *file = vfs_open(TRUEAXIS_FILE, "r");
    if (file == NULL) {
        *why = "there is no such file";
        return NULL;
    }
    size_t size = file->size, got = 0;
    if (size == 0)
        *why = "the file is empty";
    else if (size > sizeof bytes)
        *why = "the file is larger than TRUEAXIS_FILE_MOST";
    else if ((got = vfs_read(bytes, 1, size, file)) != size)
        *why = "the file cannot be read";
    vfs_close(file);
    *length = size;
    return size != 0 && got == size ? bytes : NULL;
}

#endif
