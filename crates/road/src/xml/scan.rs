//! Searches in the bytes of an XML text.

use std::borrow::Cow;

/// Returns the position of the first `needle` at or after `from`, eight bytes per step.
pub(super) fn find(bytes: &[u8], from: usize, needle: u8) -> Option<usize> {
    const ONES: u64 = 0x0101_0101_0101_0101;
    let pattern = ONES * u64::from(needle);
    let mut at = from;
    let mut eights = bytes.get(from..)?.chunks_exact(8);
    for eight in &mut eights {
        let word = u64::from_le_bytes(eight.try_into().unwrap_or_default()) ^ pattern;
        // The lowest set bit belongs to the first byte that is zero (Hacker's Delight, 6-1).
        let zeros = word.wrapping_sub(ONES) & !word & (ONES << 7);
        if zeros != 0 {
            return Some(at + zeros.trailing_zeros() as usize / 8);
        }
        at += 8;
    }
    eights.remainder().iter().position(|byte| *byte == needle).map(|place| at + place)
}

/// Returns the position of the first `needle`.
pub(super) fn find_text(bytes: &[u8], needle: &[u8]) -> Option<usize> {
    let mut from = 0;
    loop {
        let at = find(bytes, from, *needle.first()?)?;
        if bytes[at..].starts_with(needle) {
            return Some(at);
        }
        from = at + 1;
    }
}

/// Returns the position after the `>` that ends the tag around `from`, outside of quotes. At least
/// one byte of a name lies before `from`.
pub(super) fn end_of_tag(bytes: &[u8], from: usize) -> Option<usize> {
    let mut at = from;
    loop {
        match bytes.get(at)? {
            b'>' => return Some(at + 1),
            quote @ (b'"' | b'\'') => at = find(bytes, at + 1, *quote)? + 1,
            _ => at += 1,
        }
    }
}

/// Returns the length of a `<!...>` that may have a subset in brackets.
pub(super) fn end_of_declaration(bytes: &[u8]) -> Option<usize> {
    let mut inside = 0usize;
    for (at, byte) in bytes.iter().enumerate() {
        match byte {
            b'[' => inside += 1,
            b']' => inside = inside.saturating_sub(1),
            b'>' if inside == 0 => return Some(at + 1),
            _ => {}
        }
    }
    None
}

/// Returns key and value of the attribute that begins at `from`, and where it ends.
pub(super) fn attribute(text: &str, from: usize) -> Option<(&str, &str, usize)> {
    let bytes = text.as_bytes();
    let is_of_key = |byte: &u8| !matches!(byte, b'=' | b'>' | b'<' | b'"' | b'\'');
    let mut equals = from;
    while is_of_key(bytes.get(equals)?) {
        equals += 1;
    }
    if bytes[equals] != b'=' {
        return None;
    }
    let mut open = equals + 1;
    while bytes.get(open)?.is_ascii_whitespace() {
        open += 1;
    }
    let quote = bytes[open];
    if !matches!(quote, b'"' | b'\'') {
        return None;
    }
    let close = find(bytes, open + 1, quote)?;
    // ASCII characters are character boundaries.
    let key = text.get(from..equals)?.trim_ascii_end();
    Some((key, text.get(open + 1..close)?, close + 1))
}

/// Returns a text with its entities resolved. Unknown entities remain as they are.
pub(super) fn resolved(text: &str) -> Cow<'_, str> {
    if !text.contains('&') {
        return Cow::Borrowed(text);
    }
    let mut whole = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find('&') {
        whole.push_str(&rest[..at]);
        rest = &rest[at..];
        let end = rest.bytes().take(LONGEST_ENTITY).position(|byte| byte == b';');
        let entity = end.map(|end| &rest[1..end]);
        match entity.and_then(|name| Some((name, character(name)?))) {
            Some((name, character)) => {
                whole.push(character);
                rest = &rest[name.len() + 2..];
            }
            None => {
                whole.push('&');
                rest = &rest[1..];
            }
        }
    }
    whole.push_str(rest);
    Cow::Owned(whole)
}

/// Longest entity, bytes.
const LONGEST_ENTITY: usize = 12;

fn character(entity: &str) -> Option<char> {
    Some(match entity {
        "amp" => '&',
        "lt" => '<',
        "gt" => '>',
        "quot" => '"',
        "apos" => '\'',
        _ => {
            let number = entity.strip_prefix('#')?;
            let code = match number.strip_prefix('x') {
                Some(hex) => u32::from_str_radix(hex, 16).ok()?,
                None => number.parse().ok()?,
            };
            char::from_u32(code).filter(|character| *character != '\0')?
        }
    })
}

/// Returns the line of a byte offset, counted from 1.
pub(crate) fn line_of(text: &str, offset: usize) -> usize {
    let at = offset.min(text.len());
    1 + text.as_bytes()[..at].iter().filter(|&&byte| byte == b'\n').count()
}
