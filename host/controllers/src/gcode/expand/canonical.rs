//! A line of the interpreter's output: `   12 N0040  STRAIGHT_FEED(1.0000, 2.0000, …)`.

/// A canonical command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line<'l> {
    /// The count of commands.
    pub count: u64,
    /// The number of the block that it comes from, if that has one.
    pub block: Option<u64>,
    /// Its name.
    pub name: &'l str,
    /// What stands in its brackets.
    pub inside: &'l str,
}

impl<'l> Line<'l> {
    /// `None` if the line is not a command.
    pub fn parse(line: &'l str) -> Option<Self> {
        let (count, rest) = line.trim().split_once(' ')?;
        let rest = rest.strip_prefix('N')?;
        let is_number = |c: char| c.is_ascii_digit() || c == '.';
        let (block, rest) = rest.split_at(rest.find(|c| !is_number(c))?);
        let (name, inside) = rest.trim_start().strip_suffix(')')?.split_once('(')?;
        let is_name = |c: char| c.is_ascii_alphanumeric() || "_.".contains(c);
        if block.is_empty() || name.is_empty() || !name.chars().all(is_name) {
            return None;
        }
        let block = match block.bytes().all(|b| b == b'.') {
            true => None,
            false => Some(block.parse().ok()?),
        };
        Some(Self {
            count: count.parse().ok()?,
            block,
            name,
            inside,
        })
    }

    /// The words in its brackets, between commas and spaces.
    pub fn words(&self) -> impl Iterator<Item = &'l str> {
        self.inside.split([',', ' ']).filter(|w| !w.is_empty())
    }

    /// So many numbers, and nothing else.
    pub fn numbers<const N: usize>(&self) -> Option<[f64; N]> {
        let mut words = self.words();
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = words.next()?.parse().ok().filter(|n: &f64| n.is_finite())?;
        }
        words.next().is_none().then_some(numbers)
    }

    /// What stands between quotation marks.
    pub fn text(&self) -> Option<&'l str> {
        self.inside.strip_prefix('"')?.strip_suffix('"')
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_read_with_their_blocks() {
        let line = "   26 N16    STRAIGHT_FEED(5.0000, -3.5000, 5.0000, 10.0000, 0.0000, 0.0000)";
        let line = Line::parse(line).unwrap();
        assert_eq!(
            (line.count, line.block, line.name),
            (26, Some(16), "STRAIGHT_FEED")
        );
        assert_eq!(line.numbers::<6>(), Some([5.0, -3.5, 5.0, 10.0, 0.0, 0.0]));
        assert_eq!(line.numbers::<5>(), None);
        let line = Line::parse("    8 N1000000000007STRAIGHT_TRAVERSE(1.0000)").unwrap();
        assert_eq!(
            (line.block, line.name),
            (Some(1_000_000_000_007), "STRAIGHT_TRAVERSE")
        );
        let line = Line::parse("    7 N..... COMMENT(\"a (b) c\")").unwrap();
        assert_eq!((line.block, line.text()), (None, Some("a (b) c")));
        let offset = "   13 N..... USE_TOOL_LENGTH_OFFSET(0.0000 0.0000 76.2000, 0.0000 0.0000 0.0000, 0.0000 0.0000 9.0)";
        assert_eq!(Line::parse(offset).unwrap().numbers::<9>().unwrap()[8], 9.0);
        for other in [
            "",
            " hello",
            "    7 N..... NAME",
            "    7 NAME(1)",
            "x N.. NAME(1)",
            "7 N1 A B(1)",
        ] {
            assert_eq!(Line::parse(other), None, "{other}");
        }
        assert_eq!(Line::parse("7 N1 A(nan)").unwrap().numbers::<1>(), None);
    }
}
