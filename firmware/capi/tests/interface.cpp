// Every function through the header, as seen by C++. interface FILE.trax OTHER.trax
//
// OTHER has other axes. Compiled and run under sanitizers by `cargo xtask capi`.
#include "trueaxis.h"
#include "trueaxis.h" // twice, as happens

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace {

int failed = 0;

void check(bool holds, const char *what, int line)
{
    if (!holds) {
        std::fprintf(stderr, "line %d: %s\n", line, what);
        failed++;
    }
}
#define CHECK(holds) check((holds), #holds, __LINE__)
#define OK(call) check((call) == TRUEAXIS_RESULT_OK, #call, __LINE__)
#define IS(call, code) check((call) == TRUEAXIS_RESULT_##code, #call, __LINE__)

using Bytes = std::vector<std::uint32_t>;

Bytes read(const char *path, std::size_t &length)
{
    std::ifstream file(path, std::ios::binary);
    std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    length = text.size();
    Bytes bytes(text.size() / 4 + 1);
    std::memcpy(bytes.data(), text.data(), text.size());
    return bytes;
}

struct Tables {
    // On the heap, with the exact size, and uninitialised: sanitizers detect every access beyond it, valgrind every
    // byte that is read before the library has written it.
    std::unique_ptr<trueaxis_tables_memory> memory{new trueaxis_tables_memory};
    trueaxis_tables *at = nullptr;
    Tables() { OK(trueaxis_tables_new(TRUEAXIS_HEADER, memory.get(), trueaxis_tables_size(), &at)); }
};

std::string reason(const trueaxis_tables *tables)
{
    std::string text(trueaxis_tables_reason(tables, nullptr, 0) + 1, 'x');
    text.resize(trueaxis_tables_reason(tables, &text[0], text.size()));
    return text;
}

void sizes()
{
    CHECK(trueaxis_tables_size() <= TRUEAXIS_TABLES_SIZE);
    CHECK(trueaxis_servo_size() <= TRUEAXIS_SERVO_SIZE);
    CHECK(trueaxis_alignment() == TRUEAXIS_ALIGNMENT);
    trueaxis_tables *at = nullptr;
    auto memory = std::make_unique<trueaxis_tables_memory>();
    IS(trueaxis_tables_new(TRUEAXIS_HEADER, nullptr, sizeof *memory, &at), NULL_POINTER);
    IS(trueaxis_tables_new(TRUEAXIS_HEADER, memory.get(), trueaxis_tables_size() - 1, &at), MEMORY);
    IS(trueaxis_tables_new(TRUEAXIS_HEADER, reinterpret_cast<char *>(memory.get()) + 4, sizeof *memory - 4, &at), MEMORY);
    IS(trueaxis_tables_new(TRUEAXIS_HEADER, memory.get(), sizeof *memory, nullptr), NULL_POINTER);
    const std::uint64_t other = TRUEAXIS_HEADER + (std::uint64_t(1) << 48);
    IS(trueaxis_tables_new(other, memory.get(), sizeof *memory, &at), HEADER_AXES);
    CHECK(std::string(trueaxis_result_text(TRUEAXIS_RESULT_HEADER_AXES)).find("TRUEAXIS_AXES") == 0);
    CHECK(std::string(trueaxis_result_text(0)) == "done");
    for (std::int32_t code = -2; code < 40; code++)
        CHECK(std::strlen(trueaxis_result_text(code)) > 3);
}

void loading(Bytes blob, std::size_t length)
{
    Tables tables;
    trueaxis_facts facts;
    IS(trueaxis_tables_facts(tables.at, &facts), NOT_LOADED);
    IS(trueaxis_tables_load(nullptr, blob.data(), length), NULL_POINTER);
    IS(trueaxis_tables_load(tables.at, nullptr, length), NULL_POINTER);
    IS(trueaxis_tables_load(tables.at, blob.data(), 0), NOT_A_BLOB);
    IS(trueaxis_tables_load(tables.at, blob.data(), length - 1), DAMAGED);
    CHECK(reason(tables.at).find("bytes") != std::string::npos);
    char three[3] = {'x', 'x', 'x'};
    CHECK(trueaxis_tables_reason(tables.at, three, sizeof three) == reason(tables.at).size());
    CHECK(three[2] == 0);
    blob[length / 8] ^= 1u;
    IS(trueaxis_tables_load(tables.at, blob.data(), length), DAMAGED);
    blob[length / 8] ^= 1u;
    blob[1] ^= 0x100u;
    IS(trueaxis_tables_load(tables.at, blob.data(), length), VERSION);
    blob[1] ^= 0x100u;
    // A copied blob may have any alignment; in place it must be aligned.
    std::vector<char> bytes(length + 1);
    std::memcpy(bytes.data() + 1, blob.data(), length);
    IS(trueaxis_tables_load(tables.at, bytes.data() + 1, length), MISALIGNED);
    Bytes copy(blob.size());
    IS(trueaxis_tables_load_copy(tables.at, bytes.data() + 1, length, copy.data(), length - 1), MEMORY);
    OK(trueaxis_tables_load_copy(tables.at, bytes.data() + 1, length, copy.data(), 4 * copy.size()));
    CHECK(reason(tables.at).empty());
    Bytes slot = blob;
    slot.resize(slot.size() + 16, ~0u);
    OK(trueaxis_tables_load_slot(tables.at, slot.data(), 4 * slot.size()));
    OK(trueaxis_tables_facts(tables.at, &facts));
    CHECK(facts.bytes == length && facts.checksum == blob[3] && facts.version == 1);
    CHECK(facts.axes > 0 && facts.axes <= TRUEAXIS_AXES && facts.policy <= TRUEAXIS_POSITION);
    char machine[8];
    CHECK(trueaxis_tables_machine(tables.at, machine, sizeof machine) > 0 && machine[0] != 0);
    for (std::size_t k = 0; k < facts.axes; k++) {
        trueaxis_axis axis;
        std::size_t found = 99;
        OK(trueaxis_tables_axis(tables.at, k, &axis));
        CHECK(axis.lower < axis.upper && axis.value_bound > 0 && axis.rate_bound > 0 && axis.ramp_rate > 0);
        CHECK(axis.reversal_rate > 0 && axis.reversal_acceleration > 0);
        CHECK((axis.unit == TRUEAXIS_DEGREES) == (std::strchr("ABC", axis.name) != nullptr));
        OK(trueaxis_tables_find_axis(tables.at, axis.name, &found));
        CHECK(found == k);
    }
    trueaxis_axis axis;
    std::size_t found = 99;
    IS(trueaxis_tables_axis(tables.at, facts.axes, &axis), INDEX);
    IS(trueaxis_tables_find_axis(tables.at, '?', &found), NAME);
    for (std::size_t k = 0; k < facts.auxiliaries; k++) {
        trueaxis_auxiliary auxiliary;
        OK(trueaxis_tables_auxiliary(tables.at, k, &auxiliary));
        CHECK(auxiliary.lowest < auxiliary.highest && auxiliary.rate > 0);
        OK(trueaxis_tables_find_auxiliary(tables.at, auxiliary.name, &found));
        CHECK(found == k);
    }
    IS(trueaxis_tables_find_auxiliary(tables.at, "no such sensor", &found), NAME);
    for (std::size_t k = 0; k < facts.adjustable; k++) {
        trueaxis_adjustable term;
        OK(trueaxis_tables_adjustable(tables.at, k, &term));
        CHECK(term.lower <= term.weight && term.weight <= term.upper && term.axis < facts.axes);
    }
    trueaxis_adjustable term;
    IS(trueaxis_tables_adjustable(tables.at, facts.adjustable, &term), INDEX);
}

struct Loop {
    std::unique_ptr<trueaxis_servo_memory> memory{new trueaxis_servo_memory};
    trueaxis_servo *servo = nullptr;
    std::vector<double> at, dq;
    explicit Loop(trueaxis_tables *tables)
    {
        trueaxis_facts facts;
        OK(trueaxis_tables_facts(tables, &facts));
        OK(trueaxis_servo_new(memory.get(), trueaxis_servo_size(), tables, &servo));
        at.assign(facts.axes, 12.5);
        dq.assign(facts.axes, 0.0);
        for (std::size_t k = 0; k < facts.auxiliaries; k++)
            OK(trueaxis_servo_set_auxiliary(servo, k, 20.0));
    }
    trueaxis_status run(int periods, std::uint32_t referenced = 0xFFFF)
    {
        for (int k = 0; k < periods; k++)
            OK(trueaxis_servo_update(servo, at.data(), at.size(), referenced, 0.001, dq.data()));
        trueaxis_status status;
        OK(trueaxis_servo_status(servo, &status));
        return status;
    }
};

void looping(const Bytes &blob, std::size_t length, const Bytes &other, std::size_t other_length)
{
    Tables first, second, foreign;
    OK(trueaxis_tables_load(first.at, blob.data(), length));
    OK(trueaxis_tables_load(foreign.at, other.data(), other_length));
    Loop loop(first.at);
    CHECK(loop.run(10).conditions & TRUEAXIS_DISABLED);
    OK(trueaxis_servo_enable(loop.servo, 1));
    trueaxis_status status = loop.run(5000);
    CHECK(status.conditions == 0 && status.factor == 1.0f);
    double most = 0;
    for (double dq : loop.dq)
        most = std::fmax(most, std::fabs(dq));
    CHECK(most > 1e-4);
    std::vector<double> computed(loop.at.size()), velocity(loop.at.size()), back(loop.at.size());
    OK(trueaxis_servo_computed(loop.servo, computed.data(), computed.size()));
    CHECK(computed == loop.dq);
    OK(trueaxis_servo_velocity(loop.servo, velocity.data(), velocity.size()));
    for (double v : velocity)
        CHECK(v == 0.0);
    for (std::size_t k = 0; k < back.size(); k++)
        back[k] = loop.at[k] + loop.dq[k];
    OK(trueaxis_servo_measured(loop.servo, back.data(), back.size(), back.data()));
    for (std::size_t k = 0; k < back.size(); k++)
        CHECK(std::fabs(back[k] - loop.at[k]) < 1e-7); // 2⁻²⁰ of a float at 12.5, times its slope of 1e-2
    // The same in single precision, as long as the doubles are exact floats.
    const std::vector<float> single(loop.at.begin(), loop.at.end());
    std::vector<float> dq(single.size());
    OK(trueaxis_servo_update_f32(loop.servo, single.data(), single.size(), 0xFFFF, 0.001f, dq.data()));
    for (std::size_t k = 0; k < dq.size(); k++)
        CHECK(double(dq[k]) == loop.dq[k]);
    IS(trueaxis_servo_update_f32(loop.servo, single.data(), single.size() + 1, 0xFFFF, 0.001f, dq.data()), COUNT);
    IS(trueaxis_servo_update_f32(loop.servo, nullptr, single.size(), 0xFFFF, 0.001f, dq.data()), NULL_POINTER);
    // Faults.
    std::vector<double> good = loop.at;
    loop.at[0] = std::numeric_limits<double>::quiet_NaN();
    CHECK(loop.run(1).conditions & TRUEAXIS_BAD_INPUT);
    char text[64];
    CHECK(trueaxis_conditions_text(TRUEAXIS_BAD_INPUT | TRUEAXIS_HELD, text, sizeof text) == 15);
    CHECK(std::string(text) == "bad input, held");
    loop.at[0] = 1e300;
    CHECK(loop.run(1).conditions & TRUEAXIS_BAD_INPUT);
    loop.at = good;
    status = loop.run(5000);
    CHECK(status.conditions == 0);
    status = loop.run(1, 0);
    CHECK(status.conditions & TRUEAXIS_UNREFERENCED);
    OK(trueaxis_servo_set_travel(loop.servo, 0, -1));
    IS(trueaxis_servo_set_travel(loop.servo, 99, -1), INDEX);
    IS(trueaxis_servo_set_auxiliary(loop.servo, 99, 0.0), INDEX);
    IS(trueaxis_servo_set_weight(loop.servo, 9999, 0.0), WEIGHT_FIXED);
    OK(trueaxis_servo_dry_run(loop.servo, 1));
    status = loop.run(5000);
    CHECK((status.conditions & TRUEAXIS_DRY_RUN) && status.factor == 0.0f);
    for (double dq : loop.dq)
        CHECK(dq == 0.0);
    OK(trueaxis_servo_dry_run(loop.servo, 0));
    loop.run(5000);
    // Weights.
    trueaxis_adjustable term;
    if (trueaxis_tables_adjustable(first.at, 0, &term) == TRUEAXIS_RESULT_OK) {
        double weight = 0;
        IS(trueaxis_servo_set_weight(loop.servo, term.term, double(term.upper) + 1.0), WEIGHT_LIMITS);
        OK(trueaxis_servo_set_weight(loop.servo, term.term, double(term.lower)));
        OK(trueaxis_servo_weight(loop.servo, term.term, &weight));
        CHECK(weight == double(term.lower));
        CHECK(loop.run(1).conditions & TRUEAXIS_FADING);
    }
    // Other tables, and the previous ones returned.
    trueaxis_tables *retired = first.at;
    IS(trueaxis_servo_swap(loop.servo, second.at, &retired), NOT_LOADED);
    CHECK(retired == nullptr);
    IS(trueaxis_servo_swap(loop.servo, foreign.at, nullptr), OTHER_AXES);
    OK(trueaxis_tables_load(foreign.at, other.data(), other_length));
    OK(trueaxis_tables_load(second.at, blob.data(), length));
    OK(trueaxis_servo_swap(loop.servo, second.at, &retired));
    IS(trueaxis_servo_swap(loop.servo, first.at, &retired), BUSY);
    IS(trueaxis_tables_load(second.at, blob.data(), length), IN_USE);
    loop.run(8000);
    IS(trueaxis_tables_load(first.at, blob.data(), length), IN_USE);
    OK(trueaxis_servo_take_retired(loop.servo, &retired));
    CHECK(retired == first.at);
    OK(trueaxis_tables_load(first.at, blob.data(), length));
    OK(trueaxis_servo_take_retired(loop.servo, &retired));
    CHECK(retired == nullptr);
    OK(trueaxis_servo_swap(loop.servo, second.at, &retired)); // in use: only the weights
    CHECK(retired == nullptr);
    IS(trueaxis_tables_load(second.at, blob.data(), length), IN_USE);
    OK(trueaxis_servo_swap(loop.servo, first.at, &retired));
    loop.run(8000);
    OK(trueaxis_servo_swap(loop.servo, second.at, &retired)); // retired, and taken again
    CHECK(retired == nullptr);
    loop.run(8000);
    // Wide positions: adding a million turns changes nothing.
    for (std::size_t k = 0; k < loop.at.size(); k++) {
        trueaxis_axis axis;
        OK(trueaxis_tables_axis(second.at, k, &axis));
        if (axis.turn > 0) {
            std::vector<double> expected = loop.dq;
            loop.at[k] += 1e6 * double(axis.turn);
            CHECK(loop.run(2).conditions == 0);
            CHECK(loop.dq == expected);
        }
    }
    OK(trueaxis_servo_release(loop.servo));
    IS(trueaxis_servo_release(loop.servo), RELEASED);
    IS(trueaxis_servo_update(loop.servo, good.data(), good.size(), 0xFFFF, 0.001, loop.dq.data()), RELEASED);
    OK(trueaxis_tables_load(first.at, blob.data(), length));
    OK(trueaxis_tables_load(second.at, blob.data(), length));
}

int evaluations = 0;

// Corrects only the first axis, by one millionth of its position.
void first_axis(const float *positions, const float *, const std::int8_t *, const float *, float *corrections)
{
    evaluations++;
    corrections[0] = 1e-6f * positions[0];
}

int right_bits()
{
    return 1;
}

int other_bits()
{
    return 0;
}

void generating(const Bytes &blob, std::size_t length)
{
    Tables tables;
    IS(trueaxis_tables_load_generated(tables.at, nullptr), NULL_POINTER);
    // Of tables, only the axes, bounds and inputs count.
    trueaxis_generated code = {blob.data(), length, nullptr, right_bits, 1234, 5678};
    IS(trueaxis_tables_load_generated(tables.at, &code), NULL_POINTER);
    code.evaluate = first_axis;
    code.check = nullptr;
    IS(trueaxis_tables_load_generated(tables.at, &code), NULL_POINTER);
    code.check = other_bits;
    IS(trueaxis_tables_load_generated(tables.at, &code), OTHER_BITS);
    code.check = right_bits;
    code.size = length - 1;
    IS(trueaxis_tables_load_generated(tables.at, &code), DAMAGED);
    trueaxis_facts facts;
    IS(trueaxis_tables_facts(tables.at, &facts), NOT_LOADED);
    code.size = length;
    OK(trueaxis_tables_load_generated(tables.at, &code));
    OK(trueaxis_tables_facts(tables.at, &facts));
    CHECK(facts.bytes == 1234 && facts.checksum == 5678);
    Loop loop(tables.at);
    IS(trueaxis_tables_load_generated(tables.at, &code), IN_USE);
    OK(trueaxis_servo_enable(loop.servo, 1));
    CHECK(loop.run(5000).factor == 1.0f);
    CHECK(evaluations >= 5000);
    CHECK(loop.dq[0] == double(1e-6f * 12.5f));
    for (std::size_t k = 1; k < loop.dq.size(); k++)
        CHECK(loop.dq[k] == 0.0);
    OK(trueaxis_servo_measured(loop.servo, loop.at.data(), loop.at.size(), loop.dq.data()));
    CHECK(std::fabs(loop.dq[0] - 12.5 * (1.0 - 1e-6)) < 1e-9);
    OK(trueaxis_servo_release(loop.servo));
    // Tables again: the code is forgotten.
    OK(trueaxis_tables_load(tables.at, blob.data(), length));
    OK(trueaxis_tables_facts(tables.at, &facts));
    CHECK(facts.bytes == length && facts.checksum == blob[3]);
    evaluations = 0;
    Loop with_tables(tables.at);
    OK(trueaxis_servo_enable(with_tables.servo, 1));
    with_tables.run(100);
    CHECK(evaluations == 0);
    OK(trueaxis_servo_release(with_tables.servo));
}

} // namespace

int main(int count, char **words)
{
    if (count < 3)
        return 2;
    std::size_t length = 0, other_length = 0;
    const Bytes blob = read(words[1], length), other = read(words[2], other_length);
    sizes();
    loading(blob, length);
    looping(blob, length, other, other_length);
    generating(blob, length);
    if (failed == 0)
        std::puts("the interface holds");
    return failed != 0;
}
