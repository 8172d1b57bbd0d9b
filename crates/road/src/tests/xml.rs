//! This crate's XML reader against quick-xml.

use quick_xml::events::Event;

use super::shared_maps;
use crate::{MapError, xml::Cursor};

/// Returns every element that this reader finds: its depth, name and attributes.
fn ours(text: &str) -> Result<Vec<String>, MapError> {
    fn walk(xml: &mut Cursor, found: &mut Vec<String>) -> Result<(), MapError> {
        let here = xml.depth();
        while let Some(name) = xml.child(here)? {
            let attributes: Vec<String> =
                xml.attributes().iter().map(|(key, value)| format!("{key}={value:?}")).collect();
            found.push(format!("{here} {name} {}", attributes.join(" ")));
            walk(xml, found)?;
        }
        Ok(())
    }
    let mut found = Vec::new();
    walk(&mut Cursor::new(text), &mut found)?;
    Ok(found)
}

fn theirs(text: &str) -> Vec<String> {
    let mut reader = quick_xml::Reader::from_str(text);
    let (mut depth, mut found) = (0, Vec::new());
    loop {
        let event = reader.read_event().expect("well-formed XML");
        let (start, inside) = match &event {
            Event::Start(start) => (start, 1),
            Event::Empty(start) => (start, 0),
            Event::End(_) => {
                depth -= 1;
                continue;
            }
            Event::Eof => return found,
            _ => continue,
        };
        let attributes: Vec<String> = start
            .attributes()
            .map(|attribute| {
                let attribute = attribute.expect("an attribute");
                format!("{}={:?}", attribute.key.into_inner(), attribute.value)
            })
            .collect();
        let name = start.name().into_inner();
        found.push(format!("{depth} {name} {}", attributes.join(" ")));
        depth += inside;
    }
}

const TRICKY: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<!DOCTYPE map [ <!ENTITY x "y>"> ]>
<!-- <road id="1"> -- > -->
<map a = "1"	b='2 "two"' c="a > b &amp; c" é="ü">
  text <![CDATA[ <road> ]] > ]]> <empty/><empty /><deep><deeper x=""><deepest/></deeper></deep >
  <long-name.with:colon
     attribute="on another line"
  />
</map>
<?after it?>"#;

#[test]
fn the_reader_finds_what_quick_xml_finds() {
    assert_eq!(ours(TRICKY).expect("well-formed XML"), theirs(TRICKY));
    for (name, text) in shared_maps() {
        let found = ours(&text).expect("well-formed XML");
        assert!(found == theirs(&text), "{name}");
    }
}

#[test]
fn texts_and_entities_are_resolved() {
    let text = r#"<a n="&lt;&#65;&#x42;&gt; &quot;&apos;&amp;&nobody; & &#0;"><g> +proj <![CDATA[=<utm>]]> &amp;<!-- not --> end<b/></g></a>"#;
    let mut xml = Cursor::new(text);
    assert_eq!(xml.child(0).expect("an element"), Some("a"));
    assert_eq!(xml.string("n"), "<AB> \"'&&nobody; & &#0;");
    assert_eq!(xml.child(1).expect("an element"), Some("g"));
    assert_eq!(xml.content().expect("a text"), "+proj =<utm> & end");
    assert_eq!(xml.child(1).expect("the end"), None);
}

#[test]
fn malformed_xml_is_rejected_on_its_line() {
    for (text, line, wanted) in [
        ("<a>\n<b>\n</a>", 3, "<b> is closed by </a>"),
        ("<a>\n<b x=1/></a>", 2, "\"x=1/\" is not an attribute"),
        ("<a>\n<b x=\"1/></a>", 2, "\"x=\"1/\" is not an attribute"),
        ("<a>\n<b x/></a>", 2, "\"x/\" is not an attribute"),
        ("<a>\n\n<!-- </a>", 3, "a comment has no end"),
        ("<a>\n< b/></a>", 2, "a \"<\" has no name"),
        ("<a>\n<b>", 2, "unexpected end of file inside <b>"),
        ("<a>\n<b", 2, "<b> has no end"),
        ("</a>", 1, "</a> has no start tag"),
    ] {
        let error = ours(text).expect_err(text);
        assert_eq!(error.line, line, "{text:?}: {error}");
        assert!(error.reason.contains(wanted), "{text:?}: {error}");
    }
}
