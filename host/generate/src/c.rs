//! The program as C99: the code, and the header with its prototype.
//!
//! The name of the function that is linked contains the shape of its arguments. The header defines the name that users
//! call, so code that was compiled for another shape does not link.

use crate::program::{Program, Samples, Statement};
use crate::text::{Syntax, checks, helpers, lines_of_bytes, rows};
use crate::{ForServo, Head};

/// The code; `header` is the name of the file of the header.
pub fn print(program: &Program, head: &Head<'_>, header: &str) -> String {
    // Several such files may be parts of one translation unit.
    let program = &named(program, head.function);
    let mut text = head.comment("// ");
    text += PREAMBLE;
    text += &format!("#include \"{header}\"\n");
    if head.servo.is_some() {
        text += &capacities(program);
    }
    for array in &program.arrays {
        let points: String = array
            .points
            .iter()
            .map(|points| format!("[{points}]"))
            .collect();
        let element = match array.samples {
            Samples::Floats(_) => "float",
            Samples::Shorts(_) => "int16_t",
        };
        text += &format!(
            "\n/* {} */\nstatic const {element} {}{points}[{}] = ",
            array.about, array.name, array.columns
        );
        text += &rows(array, ['{', '}'], C.float);
        text += ";\n";
    }
    text += &helpers(program, [HELD, CIRCULAR, LINE, BY_TRAVEL]);
    text += &body(program, head);
    text += &check(program, head);
    if let Some(servo) = &head.servo {
        text += &for_servo(program, head, servo);
    }
    text
}

/// The header: prototype, counts and checksum.
pub fn header(program: &Program, head: &Head<'_>) -> String {
    let mut text = head.comment("// ");
    let function = head.function;
    let macros = function.to_uppercase();
    text += &format!("#ifndef {macros}_H\n#define {macros}_H\n\n#include <stdint.h>\n");
    if head.servo.is_some() {
        text += "#include \"trueaxis.h\"\n";
    }
    text += &format!(
        "\n#define {macros}_INPUTS {}\n#define {macros}_AXES {}\n#define {macros}_WEIGHTS {}\n\
         /* Of the compensation that the code evaluates. */\n#define {macros}_CHECKSUM {:#010X}U\n",
        program.inputs, program.axes, program.weights, head.checksum
    );
    text += "\n#ifdef __cplusplus\nextern \"C\" {\n#endif\n\n";
    text += &format!("{};\n\n", signature(program, &symbol(program, head)));
    text += &comment(program, head);
    let mut arguments = vec!["inputs"];
    arguments.extend(program.is_directional.then_some("travel"));
    arguments.extend((program.weights > 0).then_some("weights"));
    arguments.push("corrections");
    text += &format!(
        "static inline {}\n{{\n    {}({});\n}}\n",
        signature(program, function),
        symbol(program, head),
        arguments.join(", ")
    );
    text += &format!(
        "\n/* 1 if this build gives the bits of the compensation; 0 if the compiler fused or reordered operations. */\n\
         int {function}_check(void);\n"
    );
    if head.servo.is_some() {
        text += &format!(
            "\n/* For trueaxis_tables_load_generated. */\nextern const trueaxis_generated {function}_generated;\n"
        );
    }
    text += &format!("\n#ifdef __cplusplus\n}}\n#endif\n\n#endif /* {macros}_H */\n");
    text
}

/// The comment above the function.
fn comment(program: &Program, head: &Head<'_>) -> String {
    let mut text =
        "/* The corrections to add to the commanded positions, in mm and degrees.\n".to_owned();
    text += &format!(" * inputs: {}.\n", head.inputs());
    if program.is_directional {
        text += " * travel: the direction in which each axis last moved: 1, -1, or 0 if unknown.\n";
    }
    if program.weights > 0 {
        text += " * weights: of the adjustable terms, in their order.\n";
    }
    let letters = head.letters();
    text + &format!(" * corrections: in the order of the axes: {letters}. */\n")
}

/// The name that is linked: with the numbers of inputs, directions, weights and corrections.
fn symbol(program: &Program, head: &Head<'_>) -> String {
    let travel = if program.is_directional {
        program.axes
    } else {
        0
    };
    format!(
        "{}_i{}_t{travel}_w{}_c{}",
        head.function, program.inputs, program.weights, program.axes
    )
}

/// The program with the name of the function before those of its arrays.
fn named(program: &Program, function: &str) -> Program {
    let mut program = program.clone();
    for array in &mut program.arrays {
        array.name = format!("{function}_{}", array.name);
    }
    program
}

/// The function that tells whether the code was compiled as it stands.
fn check(program: &Program, head: &Head<'_>) -> String {
    let function = head.function;
    let axes = program.axes;
    let mut members = format!("    float inputs[{}];\n", program.inputs);
    let mut arguments = format!("{function}_checks[k].inputs");
    if program.is_directional {
        members += &format!("    int8_t travel[{axes}];\n");
        arguments += &format!(", {function}_checks[k].travel");
    }
    if program.weights > 0 {
        members += &format!("    float weights[{}];\n", program.weights);
        arguments += &format!(", {function}_checks[k].weights");
    }
    format!(
        "
/* At these inputs, operations that are fused with others or done in another order change a bit. */
static const struct {{
{members}    float corrections[{axes}];
}} {function}_checks[{count}] = {{
{lines}}};

int {function}_check(void)
{{
    /* Read from memory, so that no corrections are computed by the compiler. */
    {pointer} = {symbol};
    int is_right = 1;
    uint32_t k;
    uint32_t axis;
    for (k = 0U; k < {count}U; k++) {{
        float found[{axes}];
        evaluate({arguments}, found);
        for (axis = 0U; axis < {axes}U; axis++) {{
            if (!(found[axis] == {function}_checks[k].corrections[axis])) {{
                is_right = 0;
            }}
        }}
    }}
    return is_right;
}}
",
        count = head.checks.len(),
        lines = checks(program, head.checks, ['{', '}'], ['{', '}'], C.float),
        pointer = signature(program, "(*const volatile evaluate)"),
        symbol = symbol(program, head),
    )
}

/// A check that the servo of the C interface has enough axes.
fn capacities(program: &Program) -> String {
    let axes = program.axes;
    format!(
        "\n#if TRUEAXIS_AXES < {axes}\n\
         #error \"TRUEAXIS_AXES: the machine has {axes} axes\"\n#endif\n\n"
    )
}

/// What `trueaxis_tables_load_generated` takes.
fn for_servo(program: &Program, head: &Head<'_>, servo: &ForServo) -> String {
    let function = head.function;
    format!(
        "
/* Axes, bounds, auxiliaries and weights as a compensation without samples: what a servo needs beside the code. */
static const union {{
    uint8_t bytes[{length}];
    uint32_t aligned;
}} {function}_facts = {{{{
{facts}}}}};

static void {function}_for_servo(const float *positions, const float *auxiliaries, const int8_t *travel,
                               const float *weights, float *corrections)
{{
{call}}}

const trueaxis_generated {function}_generated = {{
    {function}_facts.bytes, sizeof {function}_facts.bytes, &{function}_for_servo, &{function}_check,
    {source}U, {checksum:#010X}U
}};
",
        length = servo.facts.len(),
        facts = lines_of_bytes(&servo.facts),
        call = call(program, function),
        source = head.length,
        checksum = head.checksum,
    )
}

/// The call of a function with what a servo has.
fn call(program: &Program, function: &str) -> String {
    // Without auxiliaries the positions are the inputs.
    let mut copies = String::new();
    let mut arguments = vec!["positions"];
    let mut unused = Vec::new();
    if program.inputs > program.axes {
        copies += &format!("    float inputs[{}];\n", program.inputs);
        for k in 0..program.inputs {
            copies += &match k.checked_sub(program.axes) {
                None => format!("    inputs[{k}] = positions[{k}];\n"),
                Some(auxiliary) => format!("    inputs[{k}] = auxiliaries[{auxiliary}];\n"),
            };
        }
        arguments = vec!["inputs"];
    } else {
        unused.push("auxiliaries");
    }
    for (name, is_used) in [
        ("travel", program.is_directional),
        ("weights", program.weights > 0),
    ] {
        match is_used {
            true => arguments.push(name),
            false => unused.push(name),
        }
    }
    arguments.push("corrections");
    for name in unused {
        copies += &format!("    (void){name};\n");
    }
    format!("{copies}    {function}({});\n", arguments.join(", "))
}

fn signature(program: &Program, name: &str) -> String {
    let mut arguments = vec![format!("const float inputs[{}]", program.inputs)];
    if program.is_directional {
        arguments.push(format!("const int8_t travel[{}]", program.axes));
    }
    if program.weights > 0 {
        arguments.push(format!("const float weights[{}]", program.weights));
    }
    arguments.push(format!("float corrections[{}]", program.axes));
    format!("void {name}({})", arguments.join(", "))
}

fn body(program: &Program, head: &Head<'_>) -> String {
    let mut text = format!("\n{}\n{{\n", signature(program, &symbol(program, head)));
    for one in &program.statements {
        text += &format!("    {}\n", statement(program, one));
    }
    text += "}\n";
    text
}

fn statement(program: &Program, statement: &Statement) -> String {
    match statement {
        Statement::Comment(comment) => format!("/* {comment} */"),
        Statement::Let(local, value) => {
            let value = C.show(program, value);
            format!("const float {} = {value};", program.name(*local))
        }
        Statement::Interval {
            index,
            fraction,
            steps,
            count,
            is_circular,
        } => {
            let (index, fraction) = (program.name(*index), program.name(*fraction));
            let function = if *is_circular { "circular" } else { "held" };
            format!(
                "uint32_t {index};\n    const float {fraction} = trueaxis_{function}({}, {count}U, &{index});",
                C.show(program, steps)
            )
        }
        Statement::Next {
            index,
            of,
            last,
            wraps,
        } => {
            let (index, of) = (program.name(*index), program.name(*of));
            let beyond = if *wraps { 0 } else { *last };
            format!("const uint32_t {index} = ({of} < {last}U) ? ({of} + 1U) : {beyond}U;")
        }
        Statement::Correction(axis, value) => {
            format!("corrections[{axis}] = {};", C.show(program, value))
        }
    }
}

const C: Syntax = Syntax {
    float: "f",
    integer: "U",
    short: ["(float)", ""],
    has_every_bracket: true,
    helper: "trueaxis_",
};

const PREAMBLE: &str = "
#include <float.h>
#include <stdint.h>

/* Every operation is rounded to binary32 by itself: only then is this the compensation to the last bit. */
#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__) \\
    || (defined(__FINITE_MATH_ONLY__) && (__FINITE_MATH_ONLY__ > 0))
#error \"compile without -ffast-math and its parts\"
#endif
#if FLT_EVAL_METHOD != 0 && FLT_EVAL_METHOD != 16
#error \"compile so that float is evaluated as float: FLT_EVAL_METHOD must be 0 or 16\"
#endif
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#if __clang_major__ >= 12
#pragma clang fp reassociate(off)
#endif
#elif defined(__GNUC__)
#pragma GCC optimize (\"fp-contract=off\")
#elif defined(_MSC_VER)
#pragma fp_contract(off)
#elif !defined(TRUEAXIS_NO_CONTRACTION)
#error \"switch off the contraction of expressions in this compiler, and define TRUEAXIS_NO_CONTRACTION\"
#endif

";
const HELD: &str = "
#ifndef TRUEAXIS_GENERATED_HELD
#define TRUEAXIS_GENERATED_HELD
/* The interval that lies so many steps from the first point, at most `intervals`, and the fraction in it. */
static inline float trueaxis_held(float steps, uint32_t intervals, uint32_t *index)
{
    float fraction = 0.0f;
    uint32_t whole = 0U;
    if (steps > 0.0f) {
        if (steps < (float)intervals) {
            whole = (uint32_t)steps;
            fraction = steps - (float)whole;
        } else {
            whole = intervals;
        }
    }
    *index = whole;
    return fraction;
}
#endif
";
const CIRCULAR: &str = "
#ifndef TRUEAXIS_GENERATED_CIRCULAR
#define TRUEAXIS_GENERATED_CIRCULAR
/* The interval that lies so many steps from the first of the points on a circle, and the fraction in it. */
static inline float trueaxis_circular(float steps, uint32_t points, uint32_t *index)
{
    float fraction = 0.0f;
    uint32_t whole = 0U;
    if ((steps > 0.0f) && (steps < (float)points)) {
        whole = (uint32_t)steps;
        fraction = steps - (float)whole;
    }
    *index = whole;
    return fraction;
}

/* A distance without its whole periods. */
static inline float trueaxis_reduced(float distance, float period, float inverse)
{
    float p = distance * inverse;
    p = (p < 4194304.0f) ? p : 4194304.0f;
    p = (p > -4194304.0f) ? p : -4194304.0f;
    {
        const float whole = (float)(int32_t)p;
        const float below = (whole > p) ? (whole - 1.0f) : whole;
        return distance - (below * period);
    }
}
#endif
";
const LINE: &str = "
#ifndef TRUEAXIS_GENERATED_LINE
#define TRUEAXIS_GENERATED_LINE
/* A straight line from `first` over one step; beyond, its ends hold. */
static inline float trueaxis_line(float steps, float first, float change, float last)
{
    float value = first;
    if (steps >= 1.0f) {
        value = last;
    } else if (steps > 0.0f) {
        value = first + (change * steps);
    } else {
        /* Before the first point. */
    }
    return value;
}
#endif
";
const BY_TRAVEL: &str = "
#ifndef TRUEAXIS_GENERATED_BY_TRAVEL
#define TRUEAXIS_GENERATED_BY_TRAVEL
/* One value after positive, another one after negative travel, 0 while the direction is not known. */
static inline float trueaxis_by_travel(int8_t travel, float positive, float negative)
{
    return (travel > 0) ? positive : ((travel < 0) ? negative : 0.0f);
}
#endif
";
