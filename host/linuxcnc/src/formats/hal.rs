//! HAL files of LinuxCNC: what they load, add to threads, connect and set.

use super::ini::{FileLocation, Ini, Open, Remark, joined};
use std::collections::BTreeMap;
use std::rc::Rc;
use trueaxis_model::source::{FileError, Named};

/// A command of a HAL file.
#[derive(Clone, Debug)]
pub struct HalCommand {
    /// Words, with values from the INI file inserted.
    pub words: Vec<String>,
    /// Place of the command.
    pub place: FileLocation,
}

/// The state of HAL after the commands of some HAL files.
#[derive(Debug, Default)]
pub struct Hal {
    /// `loadrt` and `loadusr`.
    pub loaded: Vec<HalCommand>,
    /// Functions of each thread in order, with the command that added them.
    pub threads: BTreeMap<String, Vec<(String, HalCommand)>>,
    /// The signal of each pin, with the command that connected it.
    pub signals: BTreeMap<String, (String, HalCommand)>,
    /// Values of pins, parameters and signals.
    pub values: BTreeMap<String, (String, HalCommand)>,
    /// The own name of each pin that has an alias, by the alias.
    aliases: BTreeMap<String, String>,
    /// Commands at which `halcmd` stops, because a value of the INI file has text after it.
    pub remarks: Vec<Remark>,
    /// Files that are not read because they are programs.
    pub programs: Vec<(String, FileLocation)>,
}

/// Maximum nesting depth of files.
const DEEPEST: usize = 16;

impl Hal {
    /// Reads a file and those it sources. `read` opens files by the names in the commands.
    ///
    /// # Errors
    /// [`FileError`]: a value that the INI file does not have, a file that cannot be read, a function at a position
    /// that a thread does not have.
    pub fn take(&mut self, source: Named, ini: &Ini, read: &Open<'_>) -> Result<(), FileError> {
        self.take_at(source, ini, read, 0)
    }

    fn take_at(
        &mut self,
        source: Named,
        ini: &Ini,
        read: &Open<'_>,
        depth: usize,
    ) -> Result<(), FileError> {
        let source = Rc::new(source);
        for (line, span) in joined(&source.text) {
            let place = FileLocation {
                source: Rc::clone(&source),
                span,
            };
            let words = words(&line, ini, &place)?;
            let Some(name) = words.first() else { continue };
            if name == "source" {
                let file = words.get(1).map_or("", String::as_str);
                if depth == DEEPEST {
                    return Err(place.error(
                        format!("`{file}` is sourced by files that source each other"),
                        "here",
                        "source a file once",
                    ));
                }
                let inner = read(file).map_err(|cause| missing(&place, file, &cause))?;
                self.take_at(inner, ini, read, depth + 1)?;
            } else {
                self.command(HalCommand { words, place })?;
            }
        }
        Ok(())
    }

    /// Reads one line, such as one in `[HAL]HALCMD`.
    ///
    /// # Errors
    /// Those of [`Self::take`].
    pub fn line(&mut self, line: &str, ini: &Ini, place: &FileLocation) -> Result<(), FileError> {
        let words = words(line, ini, place)?;
        self.command(HalCommand {
            words,
            place: place.clone(),
        })
    }

    fn command(&mut self, command: HalCommand) -> Result<(), FileError> {
        let words: Vec<&str> = command.words.iter().map(String::as_str).collect();
        self.remarks.extend(surplus(&words, &command.place));
        match words[..] {
            ["loadrt" | "loadusr", ..] => self.loaded.push(command),
            ["addf", function, thread] => self.add(function, thread, "-1", &command)?,
            ["addf", function, thread, at] => self.add(function, thread, at, &command)?,
            ["delf", function, thread] => {
                if let Some(functions) = self.threads.get_mut(thread) {
                    functions.retain(|(name, _)| name != function);
                }
            }
            ["net", signal, ref pins @ ..] => {
                for pin in pins.iter().filter(|p| !is_arrow(p)) {
                    self.link(pin, signal, &command);
                }
            }
            ["linkps", pin, ref rest @ ..] => {
                if let Some(signal) = rest.iter().find(|w| !is_arrow(w)) {
                    self.link(pin, signal, &command);
                }
            }
            ["linksp", signal, ref rest @ ..] => {
                if let Some(pin) = rest.iter().find(|w| !is_arrow(w)) {
                    self.link(pin, signal, &command);
                }
            }
            // Both pins are connected to a signal with the name of the first one.
            ["linkpp", first, ref rest @ ..] => {
                if let Some(second) = rest.iter().find(|w| !is_arrow(w)) {
                    self.link(first, first, &command);
                    self.link(second, first, &command);
                }
            }
            ["unlinkp", pin] => {
                let pin = self.pin(pin);
                self.signals.remove(&pin);
            }
            // A pin has its own name and one other: an alias of an alias takes its place.
            ["alias", "pin" | "param", pin, alias] => {
                let pin = self.unalias(pin);
                self.aliases.insert(alias.to_owned(), pin);
            }
            ["unalias", "pin" | "param", pin] => {
                self.unalias(pin);
            }
            ["delsig", "all"] => self.signals.clear(),
            ["delsig", signal] => self.signals.retain(|_, (of, _)| of != signal),
            ["setp" | "sets", pin, value, ..] => {
                let value = (value.to_owned(), command.clone());
                let pin = self.pin(pin);
                self.values.insert(pin, value);
            }
            _ => {}
        }
        Ok(())
    }

    fn link(&mut self, pin: &str, signal: &str, command: &HalCommand) {
        let to = (signal.to_owned(), command.clone());
        let pin = self.pin(pin);
        self.signals.insert(pin, to);
    }

    /// The name of a pin without aliases.
    fn pin(&self, name: &str) -> String {
        self.aliases
            .get(name)
            .map_or(name, String::as_str)
            .to_owned()
    }

    /// Takes the alias of a pin away; returns the pin's own name.
    fn unalias(&mut self, name: &str) -> String {
        let pin = self.pin(name);
        self.aliases.retain(|_, of| *of != pin);
        pin
    }

    /// Adds a function to a thread; 1 is the first position, −1 the last.
    fn add(
        &mut self,
        function: &str,
        thread: &str,
        at: &str,
        command: &HalCommand,
    ) -> Result<(), FileError> {
        let functions = self.threads.entry(thread.to_owned()).or_default();
        let count = functions.len();
        let index = match at.parse::<i64>() {
            Ok(at) if at > 0 => usize::try_from(at - 1).ok(),
            Ok(at) if at < 0 => usize::try_from(-1 - at)
                .ok()
                .and_then(|n| count.checked_sub(n)),
            _ => None,
        };
        let Some(index) = index.filter(|index| *index <= count) else {
            return Err(command.place.error(
                format!("`{at}` is not a place in {thread}, which has {count} functions here"),
                "here",
                "write a place from 1 on, or -1 for the end",
            ));
        };
        functions.insert(index, (function.to_owned(), command.clone()));
        Ok(())
    }

    /// The signal of a pin.
    #[must_use]
    pub fn signal(&self, pin: &str) -> Option<&str> {
        Some(&self.signals.get(pin)?.0)
    }

    /// The value of a pin, its own or that of its signal, if one is set.
    #[must_use]
    pub fn value(&self, pin: &str) -> Option<(f64, &HalCommand)> {
        let set = self.values.get(self.signal(pin).unwrap_or(pin));
        let (value, command) = set.or_else(|| self.values.get(pin))?;
        Some((number(value)?, command))
    }

    /// All pins of a signal.
    pub fn pins<'h>(&'h self, signal: &'h str) -> impl Iterator<Item = &'h str> {
        let pins = self.signals.iter();
        pins.filter(move |(_, (of, _))| of == signal)
            .map(|(pin, _)| pin.as_str())
    }

    /// The command that loads a module.
    #[must_use]
    pub fn load(&self, module: &str) -> Option<&HalCommand> {
        let mut loaded = self.loaded.iter();
        loaded.find(|c| c.words[0] == "loadrt" && c.words.get(1).is_some_and(|w| w == module))
    }
}

impl HalCommand {
    /// The value of a module parameter: `axes=XYZ`.
    #[must_use]
    pub fn parameter(&self, name: &str) -> Option<&str> {
        let mut words = self.words.iter();
        words.find_map(|word| word.strip_prefix(name)?.strip_prefix('='))
    }
}

/// The error for a file, named in a HAL or INI file, that cannot be read.
pub fn missing(place: &FileLocation, file: &str, cause: &str) -> FileError {
    place.error(
        format!("the HAL file `{file}` cannot be read: {cause}"),
        "named here",
        "HAL files are looked up next to the INI file, or in LinuxCNC's library if LIB: precedes the name",
    )
}

/// A value as `halcmd` takes it: TRUE and FALSE in any case for bits, hexadecimal numbers for integers.
fn number(value: &str) -> Option<f64> {
    let bit = |word: &str| value.eq_ignore_ascii_case(word);
    match value.get(..2) {
        _ if bit("TRUE") => Some(1.0),
        _ if bit("FALSE") => Some(0.0),
        Some("0x" | "0X") => u32::from_str_radix(&value[2..], 16).ok().map(f64::from),
        _ => value.parse().ok(),
    }
}

/// Arguments that a command does not take. `halcmd` takes comments out of a line before it inserts values of the INI file,
/// so that the words of a comment after a value become arguments.
fn surplus(words: &[&str], place: &FileLocation) -> Option<Remark> {
    let from = match words[..] {
        ["setp" | "sets", ..] => 3,
        ["loadusr", ..] => return None,
        _ => words.iter().position(|word| word.starts_with('#'))?,
    };
    let surplus = words.get(from..)?.join(" ");
    (!surplus.is_empty()).then(|| Remark {
        place: place.clone(),
        reason: format!(
            "halcmd takes `{surplus}` as arguments of {} and stops here",
            words[0]
        ),
        write: "the value alone; in the INI file, put a comment on a line of its own".to_owned(),
    })
}

fn is_arrow(word: &str) -> bool {
    matches!(word, "=>" | "<=" | "<=>")
}

/// The words of a line without its comment, with values from the INI file inserted.
fn words(line: &str, ini: &Ini, place: &FileLocation) -> Result<Vec<String>, FileError> {
    let mut words = Vec::new();
    let mut word: Option<String> = None;
    let mut quote: Option<char> = None;
    let mut rest = line.chars();
    while let Some(c) = rest.next() {
        match (quote, c) {
            (Some(end), c) if c == end => quote = None,
            (None, '"' | '\'') => {
                quote = Some(c);
                word.get_or_insert_default();
            }
            (None, '#') => break,
            (None, c) if c.is_whitespace() => words.extend(word.take()),
            (_, '[') if rest.as_str().contains(']') => {
                let (section, after) = rest.as_str().split_once(']').unwrap_or_default();
                let (key, after) = name(after);
                if key.is_empty() {
                    word.get_or_insert_default().push('[');
                    continue;
                }
                let entry = ini.get(section, key).ok_or_else(|| {
                    place.error(
                        format!("the INI file has no [{section}]{key}"),
                        "asked for here",
                        format!("write {key} = … below [{section}] in the INI file"),
                    )
                })?;
                word.get_or_insert_default().push_str(&entry.value);
                rest = after.chars();
            }
            (_, c) => word.get_or_insert_default().push(c),
        }
    }
    words.extend(word);
    // A value from the INI file may consist of several words.
    let split =
        |word: String| -> Vec<String> { word.split_whitespace().map(str::to_owned).collect() };
    Ok(words.into_iter().flat_map(split).collect())
}

/// A name at the start of a text, possibly in parentheses, and the remainder.
fn name(text: &str) -> (&str, &str) {
    if let Some((inner, after)) = text.strip_prefix('(').and_then(|t| t.split_once(')')) {
        return (inner, after);
    }
    let end = text.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_' || c == '-'));
    text.split_at(end.unwrap_or(text.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(name: &str, text: &str) -> Named {
        Named {
            name: name.to_owned(),
            text: text.to_owned(),
        }
    }

    fn take(text: &str) -> Result<Hal, FileError> {
        let ini = "[KINS]\nKINEMATICS = trivkins coordinates=XYZ\n[JOINT_0]\nSCALE = 100\n";
        let ini = Ini::read(source("m.ini", ini), &|_| Err("none".into())).unwrap();
        let mut hal = Hal::default();
        let read = |name: &str| match name {
            "more.hal" => Ok(source(name, "setp b [JOINT_0](SCALE)5\n")),
            "self.hal" => Ok(source(name, "source self.hal\n")),
            _ => Err("there is none".to_owned()),
        };
        hal.take(source("m.hal", text), &ini, &read)?;
        Ok(hal)
    }

    #[test]
    fn connections_values_and_functions_are_those_at_the_end() {
        let hal = take(
            "loadrt [KINS]KINEMATICS # the module\naddf b t\naddf c t\naddf a t 1\naddf d t -2\n\
             net x p.out => q.in \\\n  r.in\nunlinkp q.in\nlinksp y q.in\nsetp a [JOINT_0]SCALE\nsource more.hal\n\
             setp m \"two words\"\n",
        )
        .unwrap();
        let kins = hal.load("trivkins").unwrap();
        assert_eq!(kins.parameter("coordinates"), Some("XYZ"));
        let order: Vec<&str> = hal.threads["t"].iter().map(|(f, _)| f.as_str()).collect();
        assert_eq!(order, ["a", "b", "d", "c"]);
        assert_eq!(hal.pins("x").collect::<Vec<_>>(), ["p.out", "r.in"]);
        assert_eq!(hal.signal("q.in"), Some("y"));
        assert_eq!(hal.values["a"].0, "100");
        assert_eq!(hal.values["b"].0, "1005");
        assert_eq!(hal.values["b"].1.place.source.name, "more.hal");
    }

    #[test]
    fn bits_and_integers_are_read_as_halcmd_reads_them() {
        let hal = take(
            "setp a TRUE\nsetp b false\nsetp c 0x1F\nsetp d -2.5\nsetp e yes\nnet x p => q\nsets x True\n",
        );
        let hal = hal.unwrap();
        let value = |pin: &str| hal.value(pin).map(|(value, _)| value);
        let found = ["a", "b", "c", "d", "e", "q", "none"].map(value);
        let wanted = [
            Some(1.0),
            Some(0.0),
            Some(31.0),
            Some(-2.5),
            None,
            Some(1.0),
            None,
        ];
        assert_eq!(found, wanted);
    }

    #[test]
    fn both_pins_of_a_link_are_on_its_signal_whatever_its_form() {
        for text in [
            "net s a.out => b.in",
            "net s a.out\nnet s b.in",
            "linkpp a.out => b.in",
            "linkpp a.out b.in",
            "linkps a.out => s\nlinksp s => b.in",
            "newsig s float\nlinkps b.in <= s\nlinksp s <= a.out",
        ] {
            let hal = take(text).unwrap();
            let signal = hal.signal("a.out").unwrap();
            let pins: Vec<&str> = hal.pins(signal).collect();
            assert_eq!(pins, ["a.out", "b.in"], "{text}");
        }
        for text in ["linkpp a.out b.in\ndelsig a.out", "net s a b\ndelsig all"] {
            assert!(take(text).unwrap().signals.is_empty(), "{text}");
        }
    }

    #[test]
    fn aliases_are_other_names_of_pins() {
        let hal = take(
            "alias pin a.out x\nnet s x => b.in\nalias pin c.v y\nsetp y 2\nunalias pin y\nsetp y 3\n",
        )
        .unwrap();
        assert_eq!(hal.signal("a.out"), Some("s"));
        assert_eq!(hal.value("c.v").map(|(value, _)| value), Some(2.0));
        assert!(
            take("alias pin a.out x\nnet s x\nunlinkp x")
                .unwrap()
                .signals
                .is_empty()
        );
    }

    /// `halrun` of 2.9 on the first: `show pin` lists b with the value 3; `setp a 4` then says "'a' not found".
    #[test]
    fn an_alias_of_an_alias_takes_its_place() {
        let hal = take("alias pin p.v a\nalias pin a b\nsetp p.v 2\nsetp b 3\nsetp a 4\nnet s b\n")
            .unwrap();
        assert_eq!(hal.values["p.v"].0, "3");
        assert_eq!(hal.signal("p.v"), Some("s"));
        let hal = take("alias pin p.v a\nalias pin a b\nunalias pin b\nsetp b 3\n").unwrap();
        assert!(!hal.values.contains_key("p.v"));
    }

    /// `halrun` of 2.9: "setp requires 2 arguments, 4 given", and "Invalid parameter `#'" from `loadrt`.
    #[test]
    fn text_after_a_value_of_the_ini_file_is_remarked() {
        let ini = "[A]\nPIVOT = 182.5 # mm\nUNIT = 5 mm\nKINS = trivkins # simple\n";
        let ini = Ini::read(source("m.ini", ini), &|_| Err("none".into())).unwrap();
        let text = "setp k.pivot [A]PIVOT\nsetp k.unit [A]UNIT\nloadrt [A]KINS\nloadusr x [A]KINS\nsetp z 1 # text\n";
        let mut hal = Hal::default();
        let done = hal.take(source("m.hal", text), &ini, &|_| Err("none".into()));
        done.unwrap();
        let reasons: Vec<&str> = hal.remarks.iter().map(|r| r.reason.as_str()).collect();
        assert_eq!(
            reasons,
            [
                "halcmd takes `# mm` as arguments of setp and stops here",
                "halcmd takes `mm` as arguments of setp and stops here",
                "halcmd takes `# simple` as arguments of loadrt and stops here",
            ]
        );
        assert_eq!(hal.value("k.pivot").map(|(value, _)| value), Some(182.5));
    }

    #[test]
    fn what_is_not_there_is_named() {
        for (text, message) in [
            ("setp a [JOINT_1]SCALE", "no [JOINT_1]SCALE"),
            (
                "source other.hal",
                "`other.hal` cannot be read: there is none",
            ),
            ("source self.hal", "source each other"),
            (
                "addf a t 3",
                "`3` is not a place in t, which has 0 functions",
            ),
            ("addf a t first", "`first` is not a place"),
        ] {
            let error = take(text).unwrap_err();
            assert!(error.message.contains(message), "{}", error.message);
        }
    }
}
