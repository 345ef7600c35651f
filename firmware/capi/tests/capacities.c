/* Response of a library with given capacities to a program for the same or other capacities, and to a blob.
 *
 * capacities FILE.trax; compiled by `cargo xtask capi` with the capacities of the program defined.
 */
#include "trueaxis.h"

#include <math.h>
#include <stdio.h>

static uint32_t blob[65536];
static trueaxis_tables_memory tables_memory;
static trueaxis_servo_memory servo_memory;

int main(int count, char **words)
{
    trueaxis_tables *tables = NULL;
    trueaxis_servo *servo = NULL;
    trueaxis_facts facts;
    char why[200] = "";
    float at[TRUEAXIS_AXES] = {0}, correction[TRUEAXIS_AXES] = {0}, most = 0;
    FILE *file = count > 1 ? fopen(words[1], "rb") : NULL;
    size_t length = file ? fread(blob, 1, sizeof blob, file) : 0;
    trueaxis_result result = trueaxis_tables_new(TRUEAXIS_HEADER, &tables_memory, sizeof tables_memory, &tables);
    if (result == TRUEAXIS_RESULT_OK)
        result = trueaxis_tables_load(tables, blob, length);
    if (result != TRUEAXIS_RESULT_OK) {
        trueaxis_tables_reason(tables, why, sizeof why);
        printf("refused: %s %s\n", trueaxis_result_text(result), why);
    } else if (trueaxis_servo_new(&servo_memory, sizeof servo_memory, tables, &servo) ||
               trueaxis_tables_facts(tables, &facts) || trueaxis_servo_enable(servo, 1)) {
        return 1;
    } else {
        for (int period = 0; period < 4000; period++)
            if (trueaxis_servo_update_f32(servo, at, facts.axes, 0xFFFF, 0.001f, correction))
                return 1;
        for (size_t k = 0; k < facts.axes; k++)
            most = fmaxf(most, fabsf(correction[k]));
        printf(most > 1e-4f ? "corrected\n" : "not corrected\n");
    }
    return file ? fclose(file) : 1;
}
