//! JSON as glTF has it, read piece by piece.
//!
//! A tree of values takes up to a hundred times the bytes of its text. Here a list or an object is a list of places
//! in the text, and what nobody asks for is never looked at. Objects and lists have the texts of their parts as
//! [`Json`]; the functions below read one of those.

use std::borrow::Cow;
use std::fmt;

use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde_json::value::RawValue;

/// A value as it stands in the text, known to be well-formed.
pub(super) type Json<'a> = &'a RawValue;

/// The members of an object, in the order of the text.
#[derive(Debug, Default)]
pub(super) struct Object<'a> {
    members: Vec<(Cow<'a, str>, Json<'a>)>,
}

impl<'a> Object<'a> {
    /// A member; `null` counts as absent, and of a name that is given twice the last one counts.
    pub fn get(&self, name: &str) -> Option<Json<'a>> {
        let member = self.members.iter().rev().find(|(known, _)| known == name);
        member.map(|(_, value)| *value).filter(|value| value.get() != "null")
    }

    /// All members.
    pub fn members(&self) -> impl Iterator<Item = (&str, Json<'a>)> {
        self.members.iter().map(|(name, value)| (name.as_ref(), *value))
    }
}

/// The name of a member, borrowed from the text unless it has escapes.
struct Name<'a>(Cow<'a, str>);

struct NameVisitor;

impl<'de> Visitor<'de> for NameVisitor {
    type Value = Name<'de>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "a name")
    }

    fn visit_borrowed_str<E>(self, name: &'de str) -> Result<Self::Value, E> {
        Ok(Name(Cow::Borrowed(name)))
    }

    fn visit_str<E>(self, name: &str) -> Result<Self::Value, E> {
        Ok(Name(Cow::Owned(name.to_owned())))
    }
}

impl<'de> Deserialize<'de> for Name<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_str(NameVisitor)
    }
}

struct ObjectVisitor;

impl<'de> Visitor<'de> for ObjectVisitor {
    type Value = Object<'de>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let mut members = Vec::new();
        while let Some((Name(name), value)) = map.next_entry()? {
            members.push((name, value));
        }
        Ok(Object { members })
    }
}

impl<'de> Deserialize<'de> for Object<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(ObjectVisitor)
    }
}

/// The object that a whole text is; fails with where it is damaged.
pub(super) fn document(text: &str) -> serde_json::Result<Object<'_>> {
    serde_json::from_str(text)
}

pub(super) fn object(json: Json) -> Option<Object> {
    serde_json::from_str(json.get()).ok()
}

pub(super) fn list(json: Json) -> Option<Vec<Json>> {
    serde_json::from_str(json.get()).ok()
}

pub(super) fn text(json: Json) -> Option<Cow<str>> {
    let name: Option<Name> = serde_json::from_str(json.get()).ok();
    name.map(|Name(text)| text)
}

pub(super) fn flag(json: Json) -> Option<bool> {
    json.get().parse().ok()
}

/// A number; beyond the range of double precision it is infinite.
pub(super) fn number(json: Json) -> Option<f64> {
    let text = json.get();
    // Rust's parser takes words such as `inf` as well.
    text.starts_with(|c: char| c == '-' || c.is_ascii_digit()).then(|| text.parse().ok()).flatten()
}

/// A whole number from 0, however it is written: `1`, `1.0` and `1e0` are the same (glTF 2.0, section 2.7).
pub(super) fn whole(json: Json) -> Option<u64> {
    if let Ok(value) = json.get().parse() {
        return Some(value);
    }
    // Beyond 2^53 a fraction is not told from none.
    let exact = |x: &f64| (0.0..=9_007_199_254_740_992.0).contains(x) && x.fract() == 0.0;
    number(json).filter(exact).map(|x| x as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn member<'a>(object: &Object<'a>, name: &str) -> Json<'a> {
        object.get(name).unwrap_or_else(|| panic!("no {name}"))
    }

    #[test]
    fn values_are_read_where_they_stand() {
        let text =
            r#"{"a": 1, "b\u0041": "x\n\"", "c": [1, [2], {}], "d": null, "e": true, "a": 2.0, "": {"f": -0.5}}"#;
        let object = document(text).unwrap();
        assert_eq!(whole(member(&object, "a")), Some(2));
        assert_eq!(super::text(member(&object, "bA")).unwrap(), "x\n\"");
        assert_eq!(list(member(&object, "c")).unwrap().len(), 3);
        assert!(object.get("d").is_none() && object.get("g").is_none());
        assert_eq!((flag(member(&object, "e")), flag(member(&object, "a"))), (Some(true), None));
        assert_eq!(number(super::object(member(&object, "")).unwrap().get("f").unwrap()), Some(-0.5));
        assert!(list(member(&object, "a")).is_none() && super::object(member(&object, "c")).is_none());
        assert_eq!(object.members().count(), 7);
    }

    #[test]
    fn whole_numbers_have_many_forms() {
        let read = |text: &str| whole(serde_json::from_str(text).unwrap());
        for (text, value) in [("7", 7), ("7.0", 7), ("7e0", 7), ("70E-1", 7), ("0.7e1", 7), ("-0", 0), ("0.0", 0)] {
            assert_eq!(read(text), Some(value), "{text}");
        }
        assert_eq!(read("18446744073709551615"), Some(u64::MAX));
        for text in ["-1", "0.5", "1e300", "1e999", "true", "\"1\"", "[1]", "18446744073709551616"] {
            assert_eq!(read(text), None, "{text}");
        }
        assert_eq!(number(serde_json::from_str("1e999").unwrap()), Some(f64::INFINITY));
    }

    #[test]
    fn damaged_text_is_refused_without_recursion() {
        for text in ["", "1", "[]", "{\"a\": }", "{\"a\": 1} x", "{\"a\": 1"] {
            assert!(document(text).is_err(), "{text}");
        }
        let deep = format!("{{\"a\": {}{}}}", "[".repeat(1 << 20), "]".repeat(1 << 20));
        assert!(document(&deep).is_ok());
    }
}
