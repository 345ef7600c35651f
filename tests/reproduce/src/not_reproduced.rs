//! Results that cannot be recomputed for lack of raw data.

use super::NotReproduced;

/// The part of the document, and the data that would be needed.
const LIST: [(&str, &str); 14] = [
    (
        "Table 4-2, Table 4-3: the parameters of the HU40 as identified, their standard deviations (section 4.7)",
        "the 123 probings of five days, where the balls stood, the travel of the machine in its coordinates",
    ),
    (
        "Figures 4.12 to 4.14: readings of the ball-bar before and after",
        "the 5990 readings of each test, the setup that was removed",
    ),
    (
        "Section 4.7: 24.5, 4.3 and 3.5 µm, called the RMS of the Cartesian volumetric error",
        "what it is: with the size and the standard deviation of Table 4-4, the RMS of the readings is at most 19.7 µm \
         (19.3² + 4.1² = 19.7²)",
    ),
    (
        "Section 4.5.1: 14 and 19 nodes of two simulated sets",
        "the two sets of 84 coefficients, and the zone of the grid",
    ),
    (
        "Section 4.7: backlash of about 5 µm of the linear axes",
        "the circular tests",
    ),
    (
        "Table 5-5, appendix of Chapter 5: the parameters of the Kolibri as identified, with 12 and 81 unknowns",
        "the probings of setups 1 to 4 and S of three days, where the four balls stood",
    ),
    (
        "Figure 5.10: the 25 polynomials",
        "their coefficients: they are drawn without numbers",
    ),
    (
        "Figure 5.12: histograms of the volumetric error",
        "the 60 probings before and after; what is drawn above is simulated",
    ),
    (
        "Section 5.9.2, 70 µm at most before: its histogram (20 to 70 µm) and its RMS along X, Y and Z (87.3, 75.4, 71.5 µm) \
         contradict each other, for a length is no less than a component",
        "the same probings",
    ),
    (
        "Table 6-5, Figure 6.11: parameters of setup S, before and after, and their scatter",
        "the probings of setup S of three days",
    ),
    (
        "Section 6.8: 4.6 µm that the ten parameters do not explain",
        "the probings: it is what the error model lacks",
    ),
    (
        "Table 7-2, Figure 7.6: parameters of the Huron after compensation, their uncertainties, 44, 4.1, 9.1 and 4.8 µm",
        "the probings of four cycles, their 26 and 10 positions, where the balls stood, the tool",
    ),
    (
        "Figures 7.1 and 7.4: the arrangement of the 40 tables, of which only the counts, A and C are published",
        "the figure with readable formulas (that of A agrees with Eq. 59, that of C has three signs wrong)",
    ),
    (
        "Table 5-5, setups 1 to 4, and the effects of backlash: mean errors of each parameter",
        "where the four balls stood; from which side the axes came",
    ),
];

/// The whole list.
pub fn list() -> Vec<NotReproduced> {
    let one = |(what, needed)| NotReproduced { what, needed };
    LIST.map(one).to_vec()
}
