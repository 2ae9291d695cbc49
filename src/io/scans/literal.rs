//! The literals of Python that the header of a `.npy` file is made of.

use super::Parsed;

/// A value.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Literal {
    Text(String),
    Number(u64),
    Bool(bool),
    /// A list or a tuple.
    List(Vec<Literal>),
    /// A dictionary with texts as keys.
    Dict(Vec<(String, Literal)>),
}

/// Lists in lists, at most; a header has three.
const MOST_DEPTH: usize = 8;

impl Literal {
    /// Reads a value that fills the text.
    pub(super) fn parse(text: &str) -> Parsed<Literal> {
        let mut reader = Reader { rest: text };
        let value = reader.value(0)?;
        match reader.peek() {
            None => Ok(value),
            Some(_) => Err(reader.unexpected()),
        }
    }

    /// The value of a key of a dictionary.
    pub(super) fn get(&self, key: &str) -> Option<&Literal> {
        match self {
            Literal::Dict(entries) => {
                entries.iter().find(|(other, _)| other == key).map(|(_, value)| value)
            }
            _ => None,
        }
    }
}

struct Reader<'a> {
    rest: &'a str,
}

impl Reader<'_> {
    /// The next character that is no space.
    fn peek(&mut self) -> Option<char> {
        self.rest = self.rest.trim_start();
        self.rest.chars().next()
    }

    /// Takes a character if it is the next.
    fn takes(&mut self, wanted: char) -> bool {
        let is_next = self.peek() == Some(wanted);
        if is_next {
            self.rest = &self.rest[wanted.len_utf8()..];
        }
        is_next
    }

    fn unexpected(&self) -> String {
        let near: String = self.rest.chars().take(20).collect();
        format!("the header cannot be read at `{near}`")
    }

    fn value(&mut self, depth: usize) -> Parsed<Literal> {
        if depth > MOST_DEPTH {
            return Err("the header is nested too deeply".into());
        }
        match self.peek() {
            Some('\'' | '"') => self.text().map(Literal::Text),
            Some('0'..='9') => self.number(),
            Some('(') => self.list('(', ')', depth),
            Some('[') => self.list('[', ']', depth),
            Some('{') => self.dict(depth),
            _ => self.word(),
        }
    }

    /// A string without escapes; a name with one has no place in a message anyway.
    fn text(&mut self) -> Parsed<String> {
        let quote = if self.takes('"') { '"' } else { '\'' };
        if quote == '\'' && !self.takes('\'') {
            return Err(self.unexpected());
        }
        let end = self.rest.find([quote, '\\']).ok_or_else(|| self.unexpected())?;
        let text = self.rest[..end].to_owned();
        self.rest = &self.rest[end..];
        if self.takes(quote) { Ok(text) } else { Err(self.unexpected()) }
    }

    fn number(&mut self) -> Parsed<Literal> {
        let digits = self.rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(self.rest.len());
        let number = self.rest[..digits].parse().map_err(|_| self.unexpected())?;
        self.rest = &self.rest[digits..];
        // Python 2 wrote long integers so.
        self.takes('L');
        Ok(Literal::Number(number))
    }

    fn word(&mut self) -> Parsed<Literal> {
        for (word, value) in [("True", true), ("False", false)] {
            if let Some(rest) = self.rest.strip_prefix(word) {
                self.rest = rest;
                return Ok(Literal::Bool(value));
            }
        }
        Err(self.unexpected())
    }

    fn list(&mut self, open: char, close: char, depth: usize) -> Parsed<Literal> {
        self.takes(open);
        let mut values = Vec::new();
        while !self.takes(close) {
            values.push(self.value(depth + 1)?);
            if !self.takes(',') && self.peek() != Some(close) {
                return Err(self.unexpected());
            }
        }
        Ok(Literal::List(values))
    }

    fn dict(&mut self, depth: usize) -> Parsed<Literal> {
        self.takes('{');
        let mut entries = Vec::new();
        while !self.takes('}') {
            self.peek();
            let key = self.text()?;
            if !self.takes(':') {
                return Err(self.unexpected());
            }
            entries.push((key, self.value(depth + 1)?));
            if !self.takes(',') && self.peek() != Some('}') {
                return Err(self.unexpected());
            }
        }
        Ok(Literal::Dict(entries))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header() {
        let header = Literal::parse(
            "{'descr': [('x', '<f4'), (\"n\", '<f4', (3,))], 'shape': (7L, 2), }  \n",
        );
        let header = header.unwrap();
        let text = |text: &str| Literal::Text(text.to_owned());
        let list = |values: &[Literal]| Literal::List(values.to_vec());
        let three = list(&[Literal::Number(3)]);
        let descr =
            list(&[list(&[text("x"), text("<f4")]), list(&[text("n"), text("<f4"), three])]);
        assert_eq!(header.get("descr"), Some(&descr));
        assert_eq!(header.get("shape"), Some(&list(&[Literal::Number(7), Literal::Number(2)])));
        assert_eq!(header.get("other"), None);
        assert_eq!(Literal::parse("()").unwrap(), list(&[]));
    }

    #[test]
    fn what_is_no_literal() {
        let deep = "(".repeat(100_000);
        for text in
            ["", "{", "{1: 2}", "{'a' 2}", "(1 2)", "'a", "'a\\'", "None", "1 1", "-1", &deep]
        {
            assert!(Literal::parse(text).is_err(), "{text:.20}");
        }
        assert!(Literal::parse("99999999999999999999").is_err());
    }
}
