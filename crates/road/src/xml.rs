//! A cursor over XML text that visits the children of the open element and skips the rest.
//!
//! It reads each byte once, borrows names and values from the text, and builds no tree.

mod number;
mod scan;

use std::cell::Cell;

use crate::MapError;
use scan::{end_of_tag, find, find_text, resolved};

pub(crate) use scan::line_of;

/// A cursor on one element at a time. Its attributes can be queried until the next step.
pub(crate) struct Cursor<'a> {
    text: &'a str,
    /// Byte offset of what has not been read yet.
    at: usize,
    /// Byte offset of the last tag.
    tag: usize,
    open: Vec<&'a str>,
    attributes: Vec<(&'a str, &'a str)>,
    /// Where the next attribute is searched first: attributes are usually queried in the order of
    /// the file.
    next: Cell<usize>,
    /// Whether the innermost open element is an empty-element tag.
    closes: bool,
}

impl<'a> Cursor<'a> {
    pub(crate) fn new(text: &'a str) -> Cursor<'a> {
        Cursor {
            text,
            at: 0,
            tag: 0,
            open: Vec::new(),
            attributes: Vec::new(),
            next: Cell::new(0),
            closes: false,
        }
    }

    /// Creates a cursor at `offset` of the text, inside an element called `root`.
    pub(crate) fn within(text: &'a str, offset: usize, root: &'a str) -> Cursor<'a> {
        Cursor { at: offset, tag: offset, open: vec![root], ..Cursor::new(text) }
    }

    /// Returns the current element's attributes, in the order of the file.
    #[cfg(test)]
    pub(crate) fn attributes(&self) -> &[(&'a str, &'a str)] {
        &self.attributes
    }

    /// Returns the number of open elements. The children of the current element are one level
    /// deeper.
    pub(crate) fn depth(&self) -> usize {
        self.open.len()
    }

    /// Moves to the next element directly inside the one at `depth`, past all deeper ones. `None`
    /// when that one closes.
    pub(crate) fn child(&mut self, depth: usize) -> Result<Option<&'a str>, MapError> {
        let bytes = self.text.as_bytes();
        while self.open.len() >= depth {
            if std::mem::take(&mut self.closes) {
                self.open.pop();
                continue;
            }
            let Some(tag) = find(bytes, self.at, b'<') else {
                self.at = bytes.len();
                let Some(inner) = self.open.last() else { return Ok(None) };
                return Err(self.error_here(format!(
                    "unexpected end of file inside <{inner}>; is the file truncated?"
                )));
            };
            self.tag = tag;
            match bytes.get(tag + 1) {
                Some(b'/') => self.close()?,
                Some(b'!' | b'?') => self.skip()?,
                _ => {
                    let is_wanted = self.open.len() == depth;
                    let name = self.name()?;
                    self.open.push(name);
                    if is_wanted {
                        self.read_attributes()?;
                        return Ok(Some(name));
                    }
                    self.at = match end_of_tag(bytes, self.at) {
                        Some(end) => end,
                        None => return Err(self.cut_off()),
                    };
                    if bytes[self.at - 2] == b'/' {
                        self.open.pop();
                    }
                }
            }
        }
        Ok(None)
    }

    /// Returns the text inside the current element, up to its end.
    pub(crate) fn content(&mut self) -> Result<String, MapError> {
        const CDATA: &str = "<![CDATA[";
        let mut content = String::new();
        let depth = self.open.len();
        while self.open.len() >= depth {
            if std::mem::take(&mut self.closes) {
                self.open.pop();
                continue;
            }
            let Some(tag) = find(self.text.as_bytes(), self.at, b'<') else {
                self.at = self.text.len();
                return Err(self.error_here("unexpected end of file inside a text".into()));
            };
            content.push_str(&resolved(self.text.get(self.at..tag).unwrap_or_default()));
            self.tag = tag;
            let rest = &self.text[tag..];
            match rest.as_bytes().get(1) {
                Some(b'/') => self.close()?,
                Some(b'!' | b'?') => {
                    self.skip()?;
                    let passed = &self.text[tag..self.at];
                    if let Some(inside) = passed.strip_prefix(CDATA) {
                        content.push_str(inside.strip_suffix("]]>").unwrap_or(inside));
                    }
                }
                _ => {
                    let name = self.name()?;
                    self.open.push(name);
                    self.read_attributes()?;
                }
            }
        }
        Ok(content.trim().to_string())
    }

    /// Returns an attribute as written in the file.
    #[inline]
    pub(crate) fn raw(&self, key: &str) -> Option<&'a str> {
        let next = self.next.get();
        match self.attributes.get(next) {
            Some((name, value)) if *name == key => {
                self.next.set(next + 1);
                Some(value)
            }
            _ => self.search(key),
        }
    }

    fn search(&self, key: &str) -> Option<&'a str> {
        let place = self.attributes.iter().position(|(name, _)| *name == key)?;
        self.next.set(place + 1);
        Some(self.attributes[place].1)
    }

    /// Returns an attribute with its entities resolved; empty if missing.
    pub(crate) fn string(&self, key: &str) -> String {
        resolved(self.raw(key).unwrap_or_default()).into_owned()
    }

    /// Returns a required attribute.
    pub(crate) fn required(&self, key: &str) -> Result<String, MapError> {
        match self.raw(key) {
            Some(raw) => Ok(resolved(raw).into_owned()),
            None => Err(self.missing(key)),
        }
    }

    /// Returns a required finite number.
    #[inline]
    pub(crate) fn number(&self, key: &str) -> Result<f64, MapError> {
        self.optional_number(key)?.ok_or_else(|| self.missing(key))
    }

    /// Returns a finite number, or `default` if the attribute is missing.
    #[inline]
    pub(crate) fn number_or(&self, key: &str, default: f64) -> Result<f64, MapError> {
        Ok(self.optional_number(key)?.unwrap_or(default))
    }

    /// Returns a finite number; `None` if the attribute is missing or empty.
    #[inline]
    pub(crate) fn optional_number(&self, key: &str) -> Result<Option<f64>, MapError> {
        match self.raw(key) {
            None => Ok(None),
            Some(raw) => self.number_in(key, raw),
        }
    }

    fn number_in(&self, key: &str, raw: &str) -> Result<Option<f64>, MapError> {
        if let Some(number) = number::decimal(raw.as_bytes())
            && number.abs() < LARGEST
        {
            return Ok(Some(number));
        }
        let raw = raw.trim();
        if raw.is_empty() {
            return Ok(None);
        }
        match raw.parse::<f64>() {
            Ok(number) if number.is_finite() && number.abs() < LARGEST => Ok(Some(number)),
            Ok(_) => Err(self.error(format!(
                "attribute {key} of <{}> is {raw}, which is out of range; the limit is {LARGEST:e}",
                self.here()
            ))),
            Err(_) => Err(self
                .error(format!("attribute {key} of <{}> is \"{raw}\", not a number", self.here()))),
        }
    }

    /// Returns a required integer.
    pub(crate) fn integer(&self, key: &str) -> Result<i32, MapError> {
        let raw = self.raw(key).ok_or_else(|| self.missing(key))?;
        raw.trim().parse().map_err(|_| {
            self.error(format!("attribute {key} of <{}> is \"{raw}\", not an integer", self.here()))
        })
    }

    /// Returns the byte offset of the current element; [`line_of`] converts it into a line.
    pub(crate) fn offset(&self) -> usize {
        self.tag
    }

    /// Returns an error on the line of the current element.
    pub(crate) fn error(&self, reason: String) -> MapError {
        MapError { line: line_of(self.text, self.tag), reason }
    }

    /// Returns an error on the line of the element at byte `offset`.
    pub(crate) fn error_at(&self, offset: usize, reason: String) -> MapError {
        MapError { line: line_of(self.text, offset), reason }
    }

    fn error_here(&self, reason: String) -> MapError {
        MapError { line: line_of(self.text, self.at), reason }
    }

    fn here(&self) -> &'a str {
        self.open.last().copied().unwrap_or("the file")
    }

    fn missing(&self, key: &str) -> MapError {
        self.error(format!("<{}> has no attribute {key}", self.here()))
    }

    fn cut_off(&self) -> MapError {
        self.error(format!("malformed XML: <{}> has no end", self.here()))
    }

    /// Reads the name after the `<` of the current tag.
    fn name(&mut self) -> Result<&'a str, MapError> {
        let bytes = self.text.as_bytes();
        let from = self.tag + 1;
        let length = bytes[from..]
            .iter()
            .position(|byte| matches!(byte, b' ' | b'\n' | b'\t' | b'\r' | b'/' | b'>' | b'<'));
        self.at = from + length.unwrap_or(bytes.len() - from);
        if self.at == from {
            return Err(self.error("malformed XML: a \"<\" has no name".into()));
        }
        if self.at - from > NAME_MAX {
            let reason = format!("an element name has {} bytes", self.at - from);
            return Err(self.error(format!("malformed XML: {reason}")));
        }
        Ok(&self.text[from..self.at])
    }

    fn close(&mut self) -> Result<(), MapError> {
        let bytes = self.text.as_bytes();
        let from = self.tag + 2;
        let Some(end) = find(bytes, from, b'>') else { return Err(self.cut_off()) };
        self.at = end + 1;
        let name = &self.text[from..end];
        match self.open.pop() {
            Some(open) if open == name || open == name.trim_ascii_end() => Ok(()),
            Some(open) => Err(self.error(format!("<{open}> is closed by </{name}>"))),
            None => Err(self.error(format!("</{name}> has no start tag"))),
        }
    }

    /// Skips a comment, a CDATA section, a processing instruction or a declaration.
    fn skip(&mut self) -> Result<(), MapError> {
        let rest = &self.text.as_bytes()[self.tag..];
        let (what, end) = match rest {
            [b'<', b'!', b'-', b'-', inside @ ..] => {
                ("a comment", find_text(inside, b"-->").map(|at| 4 + at + 3))
            }
            [b'<', b'!', b'[', inside @ ..] => {
                ("a CDATA section", find_text(inside, b"]]>").map(|at| 3 + at + 3))
            }
            [b'<', b'?', inside @ ..] => {
                ("an instruction", find_text(inside, b"?>").map(|at| 2 + at + 2))
            }
            _ => ("a declaration", scan::end_of_declaration(rest)),
        };
        match end {
            Some(end) => {
                self.at = self.tag + end;
                Ok(())
            }
            None => Err(self.error(format!("malformed XML: {what} has no end"))),
        }
    }

    /// Reads the current tag from after its name to its end.
    fn read_attributes(&mut self) -> Result<(), MapError> {
        self.attributes.clear();
        self.next.set(0);
        let bytes = self.text.as_bytes();
        loop {
            let mut at = self.at;
            while bytes.get(at).is_some_and(u8::is_ascii_whitespace) {
                at += 1;
            }
            self.at = at;
            match bytes.get(at) {
                Some(b'>') => {
                    self.at += 1;
                    return Ok(());
                }
                Some(b'/') if bytes.get(at + 1) == Some(&b'>') => {
                    self.at += 2;
                    self.closes = true;
                    return Ok(());
                }
                Some(_) => {}
                None => return Err(self.cut_off()),
            }
            let Some((key, value, after)) = scan::attribute(self.text, at) else {
                let rest = self.text.get(at..).unwrap_or_default();
                let start = rest.split([' ', '\n', '\r', '\t', '>']).next().unwrap_or_default();
                let start: String = start.chars().take(40).collect();
                return Err(self.error(format!(
                    "<{}>: \"{start}\" is not an attribute of the form name=\"value\"",
                    self.here()
                )));
            };
            self.attributes.push((key, value));
            self.at = after;
        }
    }
}

/// Longest name, bytes.
const NAME_MAX: usize = 1000;

/// Coordinates and lengths beyond this are errors in the file, metres.
const LARGEST: f64 = 1e9;
