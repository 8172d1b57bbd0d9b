//! A cursor over XML text that walks children of the open element and forgets the rest.

use crate::MapError;
use quick_xml::Reader;
use quick_xml::events::{BytesEnd, BytesStart, Event};
use std::borrow::Cow;

/// Stands on one element at a time; its attributes may be asked until the next step.
pub(crate) struct Cursor<'a> {
    text: &'a str,
    reader: Reader<&'a [u8]>,
    open: Vec<&'a str>,
    attributes: Vec<(&'a str, &'a str)>,
    /// The innermost open element was written as one that holds nothing.
    closes: bool,
}

impl<'a> Cursor<'a> {
    pub(crate) fn new(text: &'a str) -> Cursor<'a> {
        let mut reader = Reader::from_str(text);
        // `close` compares the names: they stand in `open` anyway.
        reader.config_mut().check_end_names = false;
        Cursor { text, reader, open: Vec::new(), attributes: Vec::new(), closes: false }
    }

    /// How many elements are open. The children of the current element stand one deeper.
    pub(crate) fn depth(&self) -> usize {
        self.open.len()
    }

    /// Steps to the next element directly inside the one at `depth`, over whatever lies deeper.
    /// None when that one closes.
    pub(crate) fn child(&mut self, depth: usize) -> Result<Option<&'a str>, MapError> {
        while self.open.len() >= depth {
            if std::mem::take(&mut self.closes) {
                self.open.pop();
                continue;
            }
            match self.event()? {
                Event::Start(start) => {
                    let name = self.name(&start)?;
                    self.open.push(name);
                    if self.open.len() == depth + 1 {
                        self.take_attributes(&start)?;
                        return Ok(Some(name));
                    }
                }
                // What lies deeper than was asked for and holds nothing is over already.
                Event::Empty(start) if self.open.len() == depth => {
                    let name = self.name(&start)?;
                    self.open.push(name);
                    self.closes = true;
                    self.take_attributes(&start)?;
                    return Ok(Some(name));
                }
                Event::End(end) => self.close(&end)?,
                Event::Eof => {
                    let Some(inner) = self.open.last() else { return Ok(None) };
                    return Err(
                        self.error(format!("the file ends inside <{inner}>; is it cut off?"))
                    );
                }
                _ => {}
            }
        }
        Ok(None)
    }

    /// The text inside the current element up to its first child or its end.
    pub(crate) fn content(&mut self) -> Result<String, MapError> {
        let mut content = String::new();
        let depth = self.open.len();
        if std::mem::take(&mut self.closes) {
            self.open.pop();
            return Ok(content);
        }
        while self.open.len() >= depth {
            match self.event()? {
                Event::Text(text) => content.push_str(&text),
                Event::CData(text) => content.push_str(&text),
                Event::Start(start) => {
                    let name = self.name(&start)?;
                    self.open.push(name);
                }
                Event::End(end) => self.close(&end)?,
                Event::Eof => return Err(self.error("the file ends inside a text".into())),
                _ => {}
            }
        }
        Ok(content.trim().to_string())
    }

    /// An attribute as it stands in the file.
    pub(crate) fn raw(&self, key: &str) -> Option<&'a str> {
        self.attributes.iter().find(|(name, _)| *name == key).map(|(_, value)| *value)
    }

    /// An attribute with its entities resolved; empty if missing.
    pub(crate) fn string(&self, key: &str) -> String {
        let raw = self.raw(key).unwrap_or_default();
        match quick_xml::escape::unescape(raw) {
            Ok(Cow::Borrowed(text)) => text.to_string(),
            Ok(Cow::Owned(text)) => text,
            Err(_) => raw.to_string(),
        }
    }

    /// An attribute that must be there.
    pub(crate) fn required(&self, key: &str) -> Result<String, MapError> {
        match self.raw(key) {
            Some(_) => Ok(self.string(key)),
            None => Err(self.missing(key)),
        }
    }

    /// A finite number that must be there.
    pub(crate) fn number(&self, key: &str) -> Result<f64, MapError> {
        self.optional_number(key)?.ok_or_else(|| self.missing(key))
    }

    /// A finite number, or `default` if the attribute is missing.
    pub(crate) fn number_or(&self, key: &str, default: f64) -> Result<f64, MapError> {
        Ok(self.optional_number(key)?.unwrap_or(default))
    }

    /// A finite number, if the attribute is there and not empty.
    pub(crate) fn optional_number(&self, key: &str) -> Result<Option<f64>, MapError> {
        let Some(raw) = self.raw(key) else { return Ok(None) };
        let raw = raw.trim();
        if raw.is_empty() {
            return Ok(None);
        }
        match raw.parse::<f64>() {
            Ok(number) if number.is_finite() && number.abs() < LARGEST => Ok(Some(number)),
            Ok(_) => Err(self.error(format!(
                "{key} of <{}> is {raw}, and numbers beyond {LARGEST:e} have no place in a map",
                self.here()
            ))),
            Err(_) => {
                Err(self.error(format!("{key} of <{}> is \"{raw}\", not a number", self.here())))
            }
        }
    }

    /// A whole number that must be there.
    pub(crate) fn integer(&self, key: &str) -> Result<i32, MapError> {
        let raw = self.raw(key).ok_or_else(|| self.missing(key))?;
        raw.trim().parse().map_err(|_| {
            self.error(format!("{key} of <{}> is \"{raw}\", not a whole number", self.here()))
        })
    }

    /// The line where the cursor stands, counted from 1.
    pub(crate) fn line(&self) -> usize {
        line_of(self.text, self.offset())
    }

    /// Where the cursor stands, in bytes; [`line_of`] turns it into a line when one is asked for.
    pub(crate) fn offset(&self) -> usize {
        self.reader.buffer_position() as usize
    }

    /// An error on the current line.
    pub(crate) fn error(&self, reason: String) -> MapError {
        MapError { line: self.line(), reason }
    }

    fn close(&mut self, end: &BytesEnd) -> Result<(), MapError> {
        let name = end.name().into_inner();
        match self.open.pop() {
            Some(open) if open == name => Ok(()),
            Some(open) => Err(self.error(format!("<{open}> is closed by </{name}>"))),
            None => Err(self.error(format!("</{name}> closes nothing"))),
        }
    }

    fn here(&self) -> &'a str {
        self.open.last().copied().unwrap_or("the file")
    }

    fn missing(&self, key: &str) -> MapError {
        self.error(format!("<{}> has no {key}", self.here()))
    }

    fn event(&mut self) -> Result<Event<'a>, MapError> {
        match self.reader.read_event() {
            Ok(event) => Ok(event),
            Err(problem) => {
                let at = self.reader.error_position() as usize;
                Err(MapError {
                    line: line_of(self.text, at),
                    reason: format!("this is not well-formed XML: {problem}"),
                })
            }
        }
    }

    fn name(&self, start: &BytesStart<'a>) -> Result<&'a str, MapError> {
        self.in_text(start.name().into_inner())
    }

    fn take_attributes(&mut self, start: &BytesStart<'a>) -> Result<(), MapError> {
        self.attributes.clear();
        let mut rest = self.in_text(start.attributes_raw())?;
        loop {
            rest = rest.trim_ascii_start();
            if rest.is_empty() {
                return Ok(());
            }
            let Some((key, value, after)) = first_attribute(rest) else {
                let start = rest.split_whitespace().next().unwrap_or_default();
                return Err(self.error(format!(
                    "<{}>: \"{start}\" is no attribute; they are written name=\"value\"",
                    self.here()
                )));
            };
            self.attributes.push((key, value));
            rest = after;
        }
    }

    /// The same slice with the life of the text: events borrow the text, but only lend it on for
    /// as long as they live themselves, so it is found there again by its address.
    fn in_text(&self, slice: &str) -> Result<&'a str, MapError> {
        let at = (slice.as_ptr() as usize).wrapping_sub(self.text.as_ptr() as usize);
        self.text
            .get(at..at.wrapping_add(slice.len()))
            .ok_or_else(|| self.error("a name could not be read in place".into()))
    }
}

/// Key and value of the attribute that `text` begins with, and what comes after it.
fn first_attribute(text: &str) -> Option<(&str, &str, &str)> {
    let bytes = text.as_bytes();
    // Names are short: looking at each byte is faster than a search.
    let equals = bytes.iter().position(|byte| *byte == b'=')?;
    let mut open = equals + 1;
    while bytes.get(open)?.is_ascii_whitespace() {
        open += 1;
    }
    let quote = bytes[open];
    if !matches!(quote, b'"' | b'\'') {
        return None;
    }
    let close = open + 1 + bytes[open + 1..].iter().position(|byte| *byte == quote)?;
    // The places of ASCII signs are borders of characters.
    Some((text[..equals].trim_ascii_end(), text.get(open + 1..close)?, text.get(close + 1..)?))
}

/// Coordinates and lengths beyond this are a fault of the file, not a place on Earth.
const LARGEST: f64 = 1e9;

/// The line of a byte offset, counted from 1.
pub(crate) fn line_of(text: &str, offset: usize) -> usize {
    let at = offset.min(text.len());
    1 + text.as_bytes()[..at].iter().filter(|&&byte| byte == b'\n').count()
}
