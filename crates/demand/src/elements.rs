//! The elements of a route file: names, attributes and children, with their lines.

use quick_xml::{
    Reader,
    events::{BytesStart, Event},
};

use crate::error::{DemandError, Place};

/// One element.
#[derive(Clone, Debug)]
pub(crate) struct Element {
    pub(crate) name: String,
    pub(crate) line: usize,
    attributes: Vec<(String, String)>,
    pub(crate) children: Vec<Element>,
    file: String,
}

impl Element {
    /// Returns the value of an attribute.
    pub(crate) fn get(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }

    /// Returns where the element stands.
    pub(crate) fn place(&self) -> Place {
        let element = match self.get("id") {
            Some(id) => format!("{} \"{id}\"", self.name),
            None => self.name.clone(),
        };
        Place { file: self.file.clone(), line: self.line, element }
    }

    /// Returns the value of an attribute that must be there.
    pub(crate) fn require(&self, name: &str) -> Result<&str, DemandError> {
        self.get(name).ok_or_else(|| self.place().error(format!("has no attribute {name}")))
    }

    /// Returns the number of an attribute.
    pub(crate) fn number(&self, name: &str) -> Result<Option<f64>, DemandError> {
        let Some(text) = self.get(name) else { return Ok(None) };
        match text.trim().parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Some(value)),
            _ => Err(self.place().error(format!("{name} is \"{text}\"; use a number"))),
        }
    }

    /// Returns a time in seconds: a number, or hours:minutes:seconds with days before them or not.
    pub(crate) fn seconds(&self, name: &str) -> Result<Option<f64>, DemandError> {
        let Some(text) = self.get(name) else { return Ok(None) };
        let parts: Option<Vec<f64>> =
            text.trim().split(':').map(|part| part.parse::<f64>().ok()).collect();
        let seconds = match parts.as_deref() {
            Some([s]) => Some(*s),
            Some([h, m, s]) => Some((h * 60.0 + m) * 60.0 + s),
            Some([d, h, m, s]) => Some(((d * 24.0 + h) * 60.0 + m) * 60.0 + s),
            _ => None,
        };
        match seconds.filter(|seconds| seconds.is_finite() && *seconds >= 0.0) {
            Some(seconds) => Ok(Some(seconds)),
            None => Err(self.place().error(format!(
                "{name} is \"{text}\"; use seconds from 0 on, or hours:minutes:seconds"
            ))),
        }
    }
}

/// Reads the elements within the outermost one, which is `root`.
pub(crate) fn read(text: &str, file: &str, root: &str) -> Result<Vec<Element>, DemandError> {
    match document(text, file)?.pop() {
        Some(top) if top.name == root => Ok(top.children),
        Some(top) => Err(DemandError::Root { file: file.to_owned(), found: top.name }),
        None => {
            let why = "it has no element".to_owned();
            Err(DemandError::Xml { file: file.to_owned(), line: 1, why })
        }
    }
}

/// Reads the outermost elements.
fn document(text: &str, file: &str) -> Result<Vec<Element>, DemandError> {
    let mut lines = Lines::default();
    let mut reader = Reader::from_str(text);
    let fails = |line: usize, why: String| DemandError::Xml { file: file.to_owned(), line, why };
    let root = Element {
        name: String::new(),
        line: 1,
        attributes: Vec::new(),
        children: Vec::new(),
        file: file.to_owned(),
    };
    let mut open = vec![root];
    loop {
        let begin = reader.buffer_position() as usize;
        let event = reader.read_event();
        // The line on which the element begins, after the text before it.
        let event = event.map_err(|why| {
            fails(lines.of(text, reader.error_position() as usize), why.to_string())
        })?;
        match event {
            Event::Start(start) => {
                let line = lines.of(text, begin);
                open.push(element(&start, line, file).map_err(|why| fails(line, why))?);
            }
            Event::Empty(start) => {
                let line = lines.of(text, begin);
                let child = element(&start, line, file).map_err(|why| fails(line, why))?;
                open.last_mut().expect("the document").children.push(child);
            }
            Event::End(_) => {
                if let Some(child) = open.pop()
                    && let Some(parent) = open.last_mut()
                {
                    parent.children.push(child);
                }
            }
            Event::Eof => break,
            _ => {}
        }
    }
    if open.len() > 1 {
        let line = lines.of(text, text.len());
        let name = &open[open.len() - 1].name;
        return Err(fails(line, format!("the file ends within <{name}>")));
    }
    Ok(open.pop().map(|document| document.children).unwrap_or_default())
}

fn element(start: &BytesStart, line: usize, file: &str) -> Result<Element, String> {
    let attributes = start
        .attributes()
        .map(|attribute| {
            let attribute = attribute.map_err(|why| why.to_string())?;
            let value = quick_xml::escape::unescape(&attribute.value);
            let value = value.map_err(|why| why.to_string())?.into_owned();
            Ok((attribute.key.into_inner().to_owned(), value))
        })
        .collect::<Result<_, String>>()?;
    let name = start.name().into_inner().to_owned();
    Ok(Element { name, line, attributes, children: Vec::new(), file: file.to_owned() })
}

/// Numbers of lines at ascending positions.
#[derive(Default)]
struct Lines {
    at: usize,
    before: usize,
}

impl Lines {
    fn of(&mut self, text: &str, position: usize) -> usize {
        let position = position.min(text.len());
        if position > self.at {
            let between = &text.as_bytes()[self.at..position];
            self.before += between.iter().filter(|&&byte| byte == b'\n').count();
            self.at = position;
        }
        self.before + 1
    }
}
