//! A loaded compensation, in memory of the caller.

use crate::Room;
use crate::code::Code;
use crate::facts::{self, Adjustable, AuxiliaryFacts, AxisFacts, Evaluate, Facts, TablesMemory};
use crate::text::Text;
use core::fmt::Write;
use core::sync::atomic::{AtomicU32, Ordering};
use trueaxis::{Compensation, Header, LoadError, VERSION};

/// Tables: a loaded compensation. Its samples stay in the blob.
pub struct Tables {
    pub(crate) about: About,
    pub(crate) compensation: Compensation<'static, Room>,
}

/// Who may access the tables, and data that the compensation does not contain.
pub(crate) struct About {
    state: AtomicU32,
    bytes: u32,
    checksum: u32,
    /// Computes the corrections instead of the compensation.
    evaluate: Option<Evaluate>,
    why: Option<LoadError>,
}

// Access states.
const EMPTY: u32 = 0;
const LOADING: u32 = 1;
const LOADED: u32 = 2;
const HELD: u32 = 3;

const _: () = {
    assert!(
        size_of::<Tables>() <= size_of::<TablesMemory>(),
        "tables have grown: raise TRUEAXIS_TABLES_WORDS in facts.rs"
    );
    assert!(align_of::<Tables>() <= align_of::<TablesMemory>());
};

impl About {
    /// Nothing is loaded.
    pub(crate) const fn empty() -> Self {
        Self {
            state: AtomicU32::new(EMPTY),
            bytes: 0,
            checksum: 0,
            evaluate: None,
            why: None,
        }
    }
}

impl Tables {
    /// Changes from one state to another if the first is current; of two threads only one succeeds.
    fn turn(&self, from: u32, to: u32) -> bool {
        #[cfg(target_has_atomic = "32")]
        return self
            .about
            .state
            .compare_exchange(from, to, Ordering::AcqRel, Ordering::Acquire)
            .is_ok();
        #[cfg(not(target_has_atomic = "32"))]
        {
            let is = self.about.state.load(Ordering::Acquire) == from;
            if is {
                self.about.state.store(to, Ordering::Release);
            }
            is
        }
    }

    /// Claims the tables for loading: no servo holds them, and none can take them until loading is done.
    pub(crate) fn claim(&self) -> Result<(), Code> {
        if self.turn(LOADED, LOADING) || self.turn(EMPTY, LOADING) {
            Ok(())
        } else {
            Err(Code::InUse)
        }
    }

    /// After [`claim`](Self::claim): loads a blob; on failure the tables are empty.
    pub(crate) fn load(&mut self, blob: &'static [u8], slot: bool) -> Result<(), Code> {
        let result = if slot {
            self.compensation.load_slot(blob)
        } else {
            self.compensation.load(blob)
        };
        let checksum = match Header::read(blob) {
            Ok(header) if result.is_ok() => header.crc,
            _ => 0,
        };
        let bytes = self.compensation.blob_len() as u32;
        self.loaded_or_empty(result, [bytes, checksum], None)
    }

    /// After [`claim`](Self::claim): loads the facts of generated code, which is to compute the corrections. `source`:
    /// length and checksum of the blob from which it was generated. On failure the tables are empty.
    pub(crate) fn load_generated(
        &mut self,
        facts: &'static [u8],
        evaluate: Evaluate,
        source: [u32; 2],
    ) -> Result<(), Code> {
        let result = self.compensation.load(facts);
        self.loaded_or_empty(result, source, Some(evaluate))
    }

    /// Ends loading.
    fn loaded_or_empty(
        &mut self,
        result: Result<(), LoadError>,
        [bytes, checksum]: [u32; 2],
        evaluate: Option<Evaluate>,
    ) -> Result<(), Code> {
        self.about.bytes = bytes;
        self.about.checksum = checksum;
        self.about.evaluate = evaluate;
        self.about.why = result.err();
        let state = if result.is_ok() { LOADED } else { EMPTY };
        self.about.state.store(state, Ordering::Release);
        result.map_err(|error| Code::from(&error))
    }

    /// The code that computes the corrections instead of tables, for the servo that holds it.
    pub(crate) fn evaluate(&self) -> Option<Evaluate> {
        self.about.evaluate
    }

    /// Marks the tables as held by a servo from now on.
    pub(crate) fn hold(&self) -> Result<(), Code> {
        if self.turn(LOADED, HELD) {
            Ok(())
        } else if self.about.state.load(Ordering::Acquire) == EMPTY {
            Err(Code::NotLoaded)
        } else {
            Err(Code::InUse)
        }
    }

    /// Releases the tables: the servo no longer reads them.
    pub(crate) fn release(&self) {
        self.about.state.store(LOADED, Ordering::Release);
    }

    /// The loaded compensation; not available during loading.
    pub(crate) fn loaded(&self) -> Result<&Compensation<'static, Room>, Code> {
        match self.about.state.load(Ordering::Acquire) {
            LOADED | HELD => Ok(&self.compensation),
            LOADING => Err(Code::InUse),
            _ => Err(Code::NotLoaded),
        }
    }

    /// The loaded compensation, for the servo that holds it.
    #[inline(always)]
    pub(crate) fn held(&self) -> &Compensation<'static, Room> {
        &self.compensation
    }

    /// Why the last blob was refused; nothing during loading.
    pub(crate) fn reason(&self, text: &mut Text<'_>) {
        let empty = self.about.state.load(Ordering::Acquire) == EMPTY;
        if empty && let Some(why) = &self.about.why {
            // Writing to a buffer cannot fail.
            let _ = write!(text, "{why}");
        }
    }

    pub(crate) fn facts(&self) -> Result<Facts, Code> {
        let c = self.loaded()?;
        Ok(Facts {
            bytes: self.about.bytes,
            checksum: self.about.checksum,
            version: VERSION,
            axes: c.axes().len() as u16,
            auxiliaries: c.auxiliaries().len() as u16,
            adjustable: c.weights().iter().count() as u16,
            tables: c.tables() as u16,
            terms: c.terms().len() as u16,
            grids: c.grids().len() as u16,
            policy: facts::policy(c.policy()),
            reserved: 0,
            inputs_used: c.inputs_used(),
        })
    }

    pub(crate) fn axis(&self, index: usize) -> Result<AxisFacts, Code> {
        let axis = self.loaded()?.axes().get(index).ok_or(Code::Index)?;
        Ok(AxisFacts::from(axis))
    }

    pub(crate) fn auxiliary(&self, index: usize) -> Result<AuxiliaryFacts, Code> {
        let auxiliaries = self.loaded()?.auxiliaries();
        let auxiliary = auxiliaries.get(index).ok_or(Code::Index)?;
        Ok(AuxiliaryFacts::from(auxiliary))
    }

    pub(crate) fn find_auxiliary(&self, name: &[u8]) -> Result<usize, Code> {
        let mut auxiliaries = self.loaded()?.auxiliaries().iter();
        let place = auxiliaries.position(|a| a.name.as_bytes() == name);
        place.ok_or(Code::Name)
    }

    pub(crate) fn find_axis(&self, name: u8) -> Result<usize, Code> {
        let mut axes = self.loaded()?.axes().iter();
        axes.position(|a| a.name == name).ok_or(Code::Name)
    }

    pub(crate) fn adjustable(&self, place: usize) -> Result<Adjustable, Code> {
        let c = self.loaded()?;
        let terms = c.terms().enumerate();
        let mut adjustable = terms.filter_map(|(term, view)| Some((term, view, view.limits?)));
        let (term, view, [lower, upper]) = adjustable.nth(place).ok_or(Code::Index)?;
        Ok(Adjustable {
            term: term as u32,
            axis: view.output.into(),
            weight: view.weight,
            lower,
            upper,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reason_is_not_read_while_a_load_may_write_it() {
        let mut tables = Tables {
            about: About::empty(),
            compensation: Compensation::empty(),
        };
        let length = |tables: &Tables| {
            let mut text = Text::new(&mut []);
            tables.reason(&mut text);
            text.end()
        };
        assert_eq!(length(&tables), 0);
        assert_eq!(tables.claim(), Ok(()));
        assert_eq!(tables.load(b"no blob", false), Err(Code::NotABlob));
        assert_ne!(length(&tables), 0);
        assert_eq!(tables.claim(), Ok(()));
        assert_eq!(length(&tables), 0);
    }
}
