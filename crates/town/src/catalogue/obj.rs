//! The lines of Wavefront OBJ files that control cages consist of.

use glam::{Vec3, vec3};

/// Why a file is not a control cage.
#[derive(Debug, PartialEq, thiserror::Error)]
#[error("line {line} of a control cage: {what}")]
pub(super) struct CageError {
    pub(super) line: usize,
    pub(super) what: &'static str,
}

/// One line. Indices count from 0.
#[derive(Debug, PartialEq)]
pub(super) enum Element<'a> {
    Vertex(Vec3),
    Group(&'a str),
    Material(&'a str),
    Face(Vec<u32>),
    Line(Vec<u32>),
    /// Two vertices and the sharpness of the edge between them, as in OpenSubdiv's shapes.
    Crease(u32, u32, f32),
    /// The words of a comment.
    Comment(Vec<&'a str>),
    /// An empty line, or the name of the object.
    Nothing,
}

/// Returns the numbers of a list of words; `None` if one of them is no number.
pub(super) fn numbers(words: &[&str]) -> Option<Vec<f32>> {
    words.iter().map(|word| word.parse().ok()).collect()
}

/// Calls `take` with each line of a file, in order. It returns what is wrong with an element.
pub(super) fn read<'a>(
    text: &'a str,
    mut take: impl FnMut(Element<'a>) -> Result<(), &'static str>,
) -> Result<(), CageError> {
    let mut vertices = 0;
    for (line, row) in (1..).zip(text.lines()) {
        let element = element(row, vertices).and_then(|element| {
            vertices += usize::from(matches!(element, Element::Vertex(_)));
            take(element)
        });
        element.map_err(|what| CageError { line, what })?;
    }
    Ok(())
}

fn element(row: &str, vertices: usize) -> Result<Element<'_>, &'static str> {
    let words: Vec<&str> = row.split_ascii_whitespace().collect();
    let Some((word, rest)) = words.split_first() else { return Ok(Element::Nothing) };
    let indices = || {
        let index = |word: &&str| {
            let number = word.split('/').next()?.parse::<usize>().ok()?;
            (1..=vertices).contains(&number).then(|| number as u32 - 1)
        };
        rest.iter().map(index).collect::<Option<Vec<u32>>>()
    };
    match *word {
        "v" => match numbers(rest).as_deref() {
            Some([x, y, z]) => Ok(Element::Vertex(vec3(*x, *y, *z))),
            _ => Err("expected three coordinates"),
        },
        "g" => Ok(Element::Group(rest.first().unwrap_or(&""))),
        "usemtl" => Ok(Element::Material(rest.first().unwrap_or(&""))),
        "f" => match indices() {
            Some(corners) if corners.len() >= 3 => Ok(Element::Face(corners)),
            _ => Err("expected at least three vertices that exist"),
        },
        "l" => match indices() {
            Some(points) if points.len() >= 2 => Ok(Element::Line(points)),
            _ => Err("expected at least two vertices that exist"),
        },
        "t" if rest.first() != Some(&"crease") => Err("unknown tag"),
        "t" => match numbers(rest.get(2..).unwrap_or(&[])).as_deref() {
            Some([a, b, sharp]) if a.max(*b) < vertices as f32 && a.min(*b) >= 0.0 => {
                Ok(Element::Crease(*a as u32, *b as u32, *sharp))
            }
            _ => Err("expected two vertices and a sharpness"),
        },
        "#" => Ok(Element::Comment(rest.to_vec())),
        "o" => Ok(Element::Nothing),
        _ => Err("unknown element"),
    }
}
