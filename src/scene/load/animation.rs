//! Animations: which are played, and the keys of what they move (glTF 2.0, section 3.11; KHR_animation_pointer).

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use glam::DMat4;

use super::Limits;
use super::accessor::{Reader, Use};
use super::document::Document;
use super::nodes::Hierarchy;
use super::notes::{Notes, Outcome, clip};
use super::part::{List, Part};
use super::pointer;
use super::variants::choose;
use crate::scene::Motion;
use crate::scene::motion::{Interpolation, Kind, Moving, NodeField, Sampler, Target, Track};

/// The animations of a file. Until the hierarchy is known, nodes are named by their indices in the file.
#[derive(Default)]
pub(super) struct Animations {
    /// All of them, and whether they are played.
    names: Vec<(String, bool)>,
    tracks: Vec<Track>,
    targets: HashSet<Target>,
    /// What these belong to.
    owners: HashSet<Owner>,
}

/// A part of the file, by its index.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Owner {
    Node(u32),
    Light(u32),
    Camera(u32),
    Material(u32),
}

impl Owner {
    fn of(target: Target) -> Self {
        match target {
            Target::Node(node, _) => Self::Node(node),
            Target::Lamp(light, _) => Self::Light(light),
            Target::Camera(camera, _) => Self::Camera(camera),
            Target::Surface(material, _) => Self::Material(material),
        }
    }
}

/// A channel whose keys are not read yet.
struct Channel {
    place: String,
    target: Target,
    kind: Kind,
    sampler: u32,
}

impl Animations {
    /// Reads what is played: the animation with the name `wanted`, otherwise with this index from 0. Without one, every
    /// animation is played that moves nothing which an earlier one moves: animations of different things run together,
    /// and of different gaits of one thing the first is shown. Fails if there is no such animation.
    pub fn read(document: &Document, wanted: Option<&str>, limits: &Limits, notes: &mut Notes) -> Outcome<Self> {
        let count = document.animations.len();
        let mut all = Self::default();
        if count == 0 && wanted.is_none() {
            return Ok(all);
        }
        let parts: Vec<_> = (0..count).map(|i| notes.or_fault(document.animations.part(i))).collect();
        let name = |part: &Option<Part>, notes: &mut Notes| {
            part.as_ref().and_then(|part| part.text("name", notes)).unwrap_or_default().into_owned()
        };
        let names: Vec<String> = parts.iter().map(|part| name(part, notes)).collect();
        let chosen = choose("animation", wanted, &names)?;
        let reader = Reader::new(document, limits);
        for (i, (part, name)) in parts.iter().zip(names).enumerate() {
            let is_wanted = chosen.is_none_or(|chosen| chosen == i);
            let played = is_wanted && part.as_ref().is_some_and(|part| all.play((document, &reader), part, notes));
            all.names.push((name, played));
        }
        Ok(all)
    }

    /// Reads an animation; false if it moves what is moved already.
    fn play(&mut self, (document, reader): (&Document, &Reader), part: &Part, notes: &mut Notes) -> bool {
        let mut channels = Vec::new();
        // What is wrong with a channel is told only if it is played.
        let mut told = Notes::default();
        for (c, json) in part.list("channels", &mut told).into_iter().enumerate() {
            let place = format!("{}, channel {c}", part.place);
            let channel = Part::of(place.clone(), json).and_then(|part| channel(document, &part, &mut told));
            let channel = channel.map_err(|cause| format!("{place}: {cause}; it is ignored"));
            channels.extend(told.or_fault(channel).flatten());
        }
        if channels.iter().any(|channel| self.targets.contains(&channel.target)) {
            return false;
        }
        notes.append(told);
        let samplers = List::of(part, "samplers", "sampler", notes);
        let mut known = HashMap::new();
        for channel in channels {
            let Channel { place, target, kind, sampler } = &channel;
            let read = match known.get(&(*sampler, *kind)) {
                Some(sampler) => Ok(Arc::clone(sampler)),
                None => keys(reader, &samplers, &channel, notes).map(Arc::new),
            };
            let read = read.map_err(|cause| format!("{place}: {cause}; it is ignored"));
            let Some(read) = notes.or_fault(read) else { continue };
            known.insert((*sampler, *kind), read.clone());
            let target = *target;
            if !self.targets.insert(target) {
                notes.fault(format!("{place}: another channel moves the same; it is ignored"));
                continue;
            }
            self.owners.insert(Owner::of(target));
            self.tracks.push(Track { target, sampler: read });
        }
        true
    }

    /// Whether anything moves.
    pub fn is_empty(&self) -> bool {
        self.tracks.is_empty()
    }

    /// Whether keys move, turn or scale a node itself.
    pub fn moves(&self, node: u32) -> bool {
        let fields = [NodeField::Translation, NodeField::Rotation, NodeField::Scale];
        fields.into_iter().any(|field| self.targets.contains(&Target::Node(node, field)))
    }

    /// Whether keys change a property of a node.
    pub fn changes(&self, node: u32, field: NodeField) -> bool {
        self.targets.contains(&Target::Node(node, field))
    }

    /// Whether keys change some property of a part of the file.
    pub fn change(&self, owner: Owner) -> bool {
        self.owners.contains(&owner)
    }

    /// How the scene moves; `None` where the file has no animations.
    pub fn motion(self, start: DMat4, hierarchy: Hierarchy, moving: Moving) -> Option<Arc<Motion>> {
        if self.names.is_empty() {
            return None;
        }
        let place = |track: Track| match track.target {
            Target::Node(node, field) => Some(Track { target: Target::Node(hierarchy.place(node)?, field), ..track }),
            _ => Some(track),
        };
        let tracks = self.tracks.into_iter().filter_map(place).collect();
        Some(Arc::new(Motion::new(self.names, (start, hierarchy.nodes), tracks, moving)))
    }
}

/// What a channel moves; `None` for what is not known, which is told.
fn channel(document: &Document, part: &Part, notes: &mut Notes) -> Outcome<Option<Channel>> {
    let sampler = part.index("sampler")?.ok_or("it names no sampler")?;
    let inner = part.part("target", notes).ok_or("it has no target")?;
    let path = inner.text("path", notes).ok_or("its target has no path")?;
    let found = if path == "pointer" {
        let extension = inner.extension("KHR_animation_pointer", notes).ok_or("its target has no pointer")?;
        let pointer = extension.text("pointer", notes).ok_or("its target has no pointer")?;
        let found = pointer::target(&pointer);
        if found.is_none() {
            notes.note(format!("{}: animation of {} is not supported; it is ignored", part.place, clip(&pointer)));
        }
        found
    } else {
        let field = pointer::node_path(&path);
        let (field, kind) = field.ok_or_else(|| format!("its path {} is unknown", clip(&path)))?;
        // Without a node the target is one of an extension that is not known.
        inner.index("node")?.map(|node| (Target::Node(node, field), kind))
    };
    let Some((target, mut kind)) = found else { return Ok(None) };
    let (list, index) = match target {
        Target::Node(node, _) => (&document.nodes, node),
        Target::Lamp(light, _) => (&document.lights, light),
        Target::Camera(camera, _) => (&document.cameras, camera),
        Target::Surface(material, _) => (&document.materials, material),
    };
    let owner = list.part(index as usize)?;
    if let Target::Node(_, NodeField::Weights) = target {
        kind = Kind::Numbers(morph_targets(document, &owner).ok_or("its node has no morph targets")?);
    }
    Ok(Some(Channel { place: part.place.clone(), target, kind, sampler }))
}

/// Morph targets of a node's mesh, if it has any.
fn morph_targets(document: &Document, node: &Part) -> Option<usize> {
    let quiet = &mut Notes::default();
    let mesh = document.meshes.part(node.index("mesh").ok()?? as usize).ok()?;
    let primitives = mesh.list("primitives", quiet);
    let count =
        |json| Part::of(String::new(), json).map_or(0, |part| part.list("targets", &mut Notes::default()).len());
    primitives.into_iter().map(count).max().filter(|count| *count > 0)
}

/// The keys of a channel.
fn keys(reader: &Reader, samplers: &List, channel: &Channel, notes: &mut Notes) -> Outcome<Sampler> {
    let Channel { place, target, kind, sampler: index } = channel;
    let part = samplers.part(*index as usize)?;
    let at = |cause: String| format!("sampler {index}: {cause}");
    let interpolation = match part.text("interpolation", notes).as_deref() {
        None | Some("LINEAR") => Interpolation::Linear,
        Some("STEP") => Interpolation::Step,
        Some("CUBICSPLINE") => Interpolation::CubicSpline,
        Some(other) => return Err(at(format!("the interpolation {} is unknown", clip(other)))),
    };
    let input = part.index("input").map_err(at)?.ok_or_else(|| at("it has no input".into()))?;
    let output = part.index("output").map_err(at)?.ok_or_else(|| at("it has no output".into()))?;
    let times = reader.numbers(&reader.open(input, Use::Time, notes).map_err(at)?).map_err(at)?;
    let (role, width) = match (target, *kind) {
        (_, Kind::Rotation) => (Use::Rotation, 4),
        // Single numbers, many to a key.
        (Target::Node(_, NodeField::Weights), _) => (Use::Keys, 1),
        (_, Kind::Numbers(width)) => (Use::Keys, width),
    };
    let elements = reader.open(output, role, notes).map_err(at)?;
    let held = elements.width();
    if held != width {
        return Err(at(format!("its values have {held} numbers and not {width}")));
    }
    let (sampler, odd) =
        Sampler::new(times, reader.numbers(&elements).map_err(at)?, interpolation, *kind).map_err(at)?;
    if let Some(odd) = odd {
        notes.fault(format!("{place}: sampler {index}: {odd}"));
    }
    Ok(sampler)
}
