/* Missing or unusable files: the controller starts, moves without corrections, and reports the reason.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#include "check.h"

static uint32_t crc(const uint8_t *bytes, size_t length, uint32_t sum)
{
    for (size_t i = 0; i < length; i++) {
        sum ^= bytes[i];
        for (int bit_number = 0; bit_number < 8; bit_number++)
            sum = sum & 1 ? sum >> 1 ^ 0xEDB88320u : sum >> 1;
    }
    return sum;
}

/* The checksum over everything but itself, at byte 12. */
static void seal(struct blob *file)
{
    uint8_t *bytes = (uint8_t *)file->bytes;
    file->bytes[3] = ~crc(bytes + 16, file->length - 16, crc(bytes, 12, 0xFFFFFFFFu));
}

/* Nothing is corrected, and the motors move exactly as they would without the plugin. */
static void moves_uncorrected(const char *reason)
{
    CHECK(strstr(said, "Warning: trueaxis: not in use: /trueaxis.trax: ") != NULL, "%s", said);
    CHECK(strstr(said, reason) != NULL, "not `%s` but `%s`", reason, said);
    home((uint8_t)(bit(N_AXIS) - 1));
    CHECK(command("$TRUEAXIS=ON") == Status_FileReadError && command("$TRUEAXIS=OFF") == Status_OK, "ok for nothing");
    CHECK(command("$TRUEAXIS=DRY") == Status_FileReadError, "ok for nothing");
    for (int moves = 0; moves < 50; moves++) {
        float to[N_AXIS], at[N_AXIS];
        for (size_t i = 0; i < N_AXIS; i++)
            to[i] = (float)floor(between(-100, 100));
        size_t before = planned;
        CHECK(line_to(to, 1000) && planned == before + 1, "%s: %zu blocks", reason, planned - before);
        CHECK(memcmp(blocks[before].plan.target_mm, to, sizeof to) == 0, "%s: corrected", reason);
        execute();
        shown(at);
        CHECK(memcmp(at, to, sizeof at) == 0, "%s: shown at %g", reason, (double)at[0]);
    }
    said_nothing();
    CHECK(command("$TRUEAXIS") == Status_OK, "status");
    CHECK(strstr(said, "[TRUEAXIS:inactive: ") != NULL && strstr(said, reason) != NULL, "%s", said);
}

#if N_AXIS == 6
static void a_is_linear(void)
{
    settings.steppers.is_rotary.mask = (uint8_t)(bit(4) | bit(5));
}

static void x_is_rotary(void)
{
    settings.steppers.is_rotary.mask |= 1;
}

static uint_fast8_t shared_motors(uint_fast8_t axis)
{
    return axis < 2 ? 3 : (uint_fast8_t)bit(axis);
}

static void belts(void)
{
    kinematics.limits_get_axis_mask = shared_motors;
}

static void start_as(const struct blob *file, void (*set_up)(void))
{
    file_bytes = file->bytes;
    file_size = file->length;
    controller_start(set_up);
}
#endif

void refused(void)
{
    static struct blob bad;
    start_with(NULL);
    moves_uncorrected("there is no such file");

    bad = *blob("router-10");
    bad.length = 0;
    start_with(&bad);
    moves_uncorrected("the file is empty");

    bad = *blob("router-10");
    bad.length -= 8;
    start_with(&bad);
    moves_uncorrected("the header states 928 bytes");

    /* Any single bit flip. */
    for (int trial = 0; trial < 200; trial++) {
        bad = *blob("router-10");
        size_t place = (size_t)between(0, (double)bad.length);
        ((uint8_t *)bad.bytes)[place] ^= (uint8_t)(1 << (int)between(0, 8));
        start_with(&bad);
        moves_uncorrected("");
    }

    /* More than exist: the number of axes, stored before the first, Y; no name follows the last one ... */
    bad = *blob("router-10");
    uint8_t *bytes = (uint8_t *)bad.bytes;
    size_t place = 16;
    while (!(bytes[place] == 3 && bytes[place + 1] == 'Y'))
        place++;
    bytes[place] = TRUEAXIS_AXES + 1;
    seal(&bad);
    start_with(&bad);
    moves_uncorrected("axis 3: the name must be an ASCII letter");
    bytes[place] = 3;
    seal(&bad);
    CHECK(memcmp(&bad.bytes, &blob("router-10")->bytes, bad.length) == 0, "the checksum");

    /* ... and in the buffer. */
    file_bytes = bad.bytes;
    file_size = 16385;
    controller_start(NULL);
    moves_uncorrected("larger than TRUEAXIS_FILE_MOST");
    /* The path that is still planned would not be remembered. */
    buffer_size = 128;
    start_with(blob("router-10"));
    moves_uncorrected("the planner has as many blocks ($398) as TRUEAXIS_TRACE");
    buffer_size = 100;

#if N_AXIS < 6
    start_with(blob("huron-13"));
    moves_uncorrected(N_AXIS == 3 ? "axis A: the controller has none" : "axis C: the controller has none");
    start_with(blob("everything"));
    moves_uncorrected("axis C: the controller has none");
#else
    start_as(blob("huron-13"), a_is_linear);
    moves_uncorrected("axis A: degrees in the tables, mm in the controller");
    start_as(blob("huron-13"), x_is_rotary);
    moves_uncorrected("axis X: mm in the tables, degrees in the controller");
    start_as(blob("huron-13"), belts);
    moves_uncorrected("axis Y: the kinematics move it with more than its motor");

    /* A good file that appears later, with a card, is loaded; then a bad one is refused, and the previous tables are
       gone. */
    start_with(NULL);
    file_bytes = blob("router-10")->bytes;
    file_size = blob("router-10")->length;
    said_nothing();
    vfs.on_mount("/", NULL, (vfs_st_mode_t){0});
    CHECK(said[0] == '\0' && command("$TRUEAXIS") == Status_OK && strstr(said, ", off, factor 0.000"), "%s", said);
    file_size -= 4;
    said_nothing();
    CHECK(command("$TRUEAXIS=LOAD") == Status_FileReadError, "loaded");
    moves_uncorrected("the header states 928 bytes");
#endif
}
