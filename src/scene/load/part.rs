//! Objects of the file with a name for messages. What cannot be read counts as absent, with a warning that names it.

use std::borrow::Cow;

use super::json::{self, Json, Object};
use super::notes::{Notes, Outcome, clip};

/// An object of the file, for example a material.
pub(super) struct Part<'a> {
    /// Its name in messages, for example `material 3`.
    pub place: String,
    object: Object<'a>,
}

impl<'a> Part<'a> {
    /// The object that `json` is, if it is one.
    pub fn of(place: String, json: Json<'a>) -> Outcome<Self> {
        match json::object(json) {
            Some(object) => Ok(Self { place, object }),
            None => Err(format!("{place} is not an object")),
        }
    }

    /// An object that is at hand.
    pub fn new(place: String, object: Object<'a>) -> Self {
        Self { place, object }
    }

    /// Whether there is such a member.
    pub fn has(&self, name: &str) -> bool {
        self.object.get(name).is_some()
    }

    /// All members with their names.
    pub fn members(&self) -> impl Iterator<Item = (&str, Json<'a>)> {
        self.object.members()
    }

    pub fn get(&self, name: &str) -> Option<Json<'a>> {
        self.object.get(name)
    }

    /// A member as `read` understands it; `what` says what it should be.
    fn member<T>(&self, name: &str, what: &str, read: impl FnOnce(Json<'a>) -> Option<T>) -> Outcome<Option<T>> {
        let Some(json) = self.object.get(name) else { return Ok(None) };
        let wrong = || format!("{}: '{}' is {}, not {what}", self.place, clip(name), clip(json.get()));
        read(json).map(Some).ok_or_else(wrong)
    }

    pub fn number(&self, name: &str, notes: &mut Notes) -> Option<f32> {
        let number = |json| json::number(json).map(|x| x as f32);
        notes.or_fault(self.member(name, "a number", number)).flatten()
    }

    pub fn flag(&self, name: &str, notes: &mut Notes) -> Option<bool> {
        notes.or_fault(self.member(name, "true or false", json::flag)).flatten()
    }

    pub fn text(&self, name: &str, notes: &mut Notes) -> Option<Cow<'a, str>> {
        notes.or_fault(self.member(name, "a text", json::text)).flatten()
    }

    /// `N` numbers.
    pub fn numbers<const N: usize>(&self, name: &str, notes: &mut Notes) -> Option<[f32; N]> {
        let read = |json| {
            let numbers = json::list(json)?.into_iter().map(|x| json::number(x).map(|x| x as f32));
            <[f32; N]>::try_from(numbers.collect::<Option<Vec<f32>>>()?).ok()
        };
        notes.or_fault(self.member(name, &format!("a list of {N} numbers"), read)).flatten()
    }

    /// Any number of numbers.
    pub fn list_of_numbers(&self, name: &str, notes: &mut Notes) -> Option<Vec<f32>> {
        let read = |json| json::list(json)?.into_iter().map(|x| json::number(x).map(|x| x as f32)).collect();
        notes.or_fault(self.member(name, "a list of numbers", read)).flatten()
    }

    /// A whole number from 0; fails if it is something else.
    pub fn count(&self, name: &str) -> Outcome<Option<u64>> {
        self.member(name, "a whole number", json::whole)
    }

    /// A place in one of the file's lists; fails if it is something else.
    pub fn index(&self, name: &str) -> Outcome<Option<u32>> {
        self.member(name, "an index", index)
    }

    /// Places in one of the file's lists; what is none is left out.
    pub fn indices(&self, name: &str, notes: &mut Notes) -> Vec<u32> {
        let mut indices = Vec::new();
        for json in self.list(name, notes) {
            match index(json) {
                Some(index) => indices.push(index),
                None => notes.loss(format!("{}: '{}' holds {}, not an index", self.place, name, clip(json.get()))),
            }
        }
        indices
    }

    /// The elements of a list, none where there is none.
    pub fn list(&self, name: &str, notes: &mut Notes) -> Vec<Json<'a>> {
        notes.or_fault(self.member(name, "a list", json::list)).flatten().unwrap_or_default()
    }

    /// An object inside of this one.
    pub fn part(&self, name: &str, notes: &mut Notes) -> Option<Part<'a>> {
        let object = notes.or_fault(self.member(name, "an object", json::object)).flatten()?;
        Some(Part { place: format!("{}.{name}", self.place), object })
    }

    /// What an extension adds to this object.
    pub fn extension(&self, name: &str, notes: &mut Notes) -> Option<Part<'a>> {
        // Most objects have none: the name of the place is only made where it is needed.
        self.object.get("extensions")?;
        let extension = self.part("extensions", notes)?.part(name, notes)?;
        Some(Part { place: format!("{}: {name}", self.place), ..extension })
    }
}

fn index(json: Json) -> Option<u32> {
    json::whole(json).and_then(|index| u32::try_from(index).ok())
}

/// A list of the file, for example its materials.
pub(super) struct List<'a> {
    what: &'static str,
    items: Vec<Json<'a>>,
}

impl<'a> List<'a> {
    /// The member `name` of the file, whose elements are called `what` in messages.
    pub fn of(root: &Part<'a>, name: &str, what: &'static str, notes: &mut Notes) -> Self {
        Self { what, items: root.list(name, notes) }
    }

    pub fn len(&self) -> usize {
        self.items.len()
    }

    /// Element `index` as an object; fails if it does not exist or is something else.
    pub fn part(&self, index: usize) -> Outcome<Part<'a>> {
        let place = format!("{} {index}", self.what);
        match self.items.get(index) {
            Some(json) => Part::of(place, json),
            None => Err(format!("{place} does not exist")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(text: &str) -> Part<'_> {
        Part::new("thing 0".into(), json::document(text).unwrap())
    }

    #[test]
    fn what_is_wrong_is_absent_and_named() {
        let part = part(r#"{"x": "one", "y": [1, 2], "z": -1, "w": {"x": 1}, "list": [0, -1, 2.0, "3"]}"#);
        let mut notes = Notes::default();
        assert_eq!(part.number("x", &mut notes), None);
        assert_eq!(part.numbers::<3>("y", &mut notes), None);
        assert_eq!(part.numbers::<2>("y", &mut notes), Some([1.0, 2.0]));
        assert_eq!(part.index("z").unwrap_err(), "thing 0: 'z' is -1, not an index");
        assert_eq!(part.indices("list", &mut notes), [0, 2]);
        let inner = part.part("w", &mut notes).unwrap();
        assert_eq!((inner.place.as_str(), inner.number("x", &mut notes)), ("thing 0.w", Some(1.0)));
        assert!(part.number("absent", &mut notes).is_none() && part.part("y", &mut notes).is_none());
        assert_eq!(notes.faults(), 5);
        let warnings = notes.finish(&crate::scene::Limits::default()).unwrap();
        assert_eq!(warnings[0], "thing 0: 'x' is \"one\", not a number");
    }
}
