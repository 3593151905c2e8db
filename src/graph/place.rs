//! Where transients lie: first fit, in order of declaration.

/// Alignment of every transient: above any device's storage buffer offset alignment (at most 256 by the standard).
const ALIGNMENT: u64 = 256;

/// Arena size that no plan exceeds unless one buffer alone is larger; below the allocation limit of every known device.
const ARENA_BYTES: u64 = 1 << 30;

/// Memory of a transient: an arena and a byte offset into it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Placement {
    /// Index of the arena.
    pub arena: u32,
    /// Byte offset.
    pub offset: u64,
}

/// A buffer that lives inside of a run.
#[derive(Debug, Clone, Copy)]
pub(super) struct Transient {
    pub bytes: u64,
    /// First and last phase in which it is used.
    pub lifetime: (u32, u32),
}

/// Bytes that a transient takes of its arena.
pub(super) fn padded(bytes: u64) -> u64 {
    bytes.next_multiple_of(ALIGNMENT)
}

/// Places each transient at the lowest offset of the first arena where no earlier one with a common phase lies. What is
/// no transient gets no place. Returns the size of each arena as well.
///
/// Arenas know what lies in them by phase, so a transient meets those alone that live at the same time: the whole takes
/// the sum of all lifetimes and of all such meetings, not the square of the number of transients.
pub(super) fn place(transients: impl Iterator<Item = Option<Transient>>) -> (Vec<Option<Placement>>, Vec<u64>) {
    let mut arenas: Vec<Arena> = Vec::new();
    let mut place_one = |transient: Transient| {
        let bytes = padded(transient.bytes);
        let mut index = 0;
        loop {
            if index == arenas.len() {
                arenas.push(Arena::default());
            }
            let offset = arenas[index].first_fit(transient.lifetime, bytes);
            if offset + bytes <= ARENA_BYTES || offset == 0 {
                arenas[index].add(transient.lifetime, (offset, offset + bytes));
                return Placement { arena: index as u32, offset };
            }
            index += 1;
        }
    };
    let placement = transients.map(|transient| transient.map(&mut place_one)).collect();
    (placement, arenas.iter().map(|arena| arena.bytes).collect())
}

/// What lies in an arena. Ranges are a first byte and the byte after the last one.
#[derive(Default)]
struct Arena {
    /// By phase.
    phases: Vec<Phase>,
    bytes: u64,
    /// Ranges in the way of one transient; kept for its memory alone.
    taken: Vec<(u64, u64)>,
}

#[derive(Default, Clone)]
struct Phase {
    /// Ranges of all that live in this phase.
    alive: Vec<(u64, u64)>,
    /// Ranges of those whose life begins in it.
    beginning: Vec<(u64, u64)>,
}

impl Arena {
    /// The lowest offset with `bytes` free bytes in all phases of `lifetime`.
    fn first_fit(&mut self, (first, last): (u32, u32), bytes: u64) -> u64 {
        // Two lives meet if one of them begins within the other: each neighbour is found once.
        let phase = |at: u32| self.phases.get(at as usize).into_iter();
        self.taken.clear();
        self.taken.extend(phase(first).flat_map(|phase| &phase.alive));
        self.taken.extend((first + 1..=last).flat_map(|at| phase(at).flat_map(|phase| &phase.beginning)));
        self.taken.sort_unstable();
        self.taken.iter().fold(0, |at, &(from, to)| if at + bytes <= from { at } else { at.max(to) })
    }

    fn add(&mut self, (first, last): (u32, u32), range: (u64, u64)) {
        if self.phases.len() <= last as usize {
            self.phases.resize(last as usize + 1, Phase::default());
        }
        self.phases[first as usize].beginning.push(range);
        for phase in &mut self.phases[first as usize..=last as usize] {
            phase.alive.push(range);
        }
        self.bytes = self.bytes.max(range.1);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The specification: every transient is compared with all earlier ones.
    fn reference(transients: &[Option<Transient>]) -> (Vec<Option<Placement>>, Vec<u64>) {
        let mut placement: Vec<Option<Placement>> = vec![None; transients.len()];
        let mut arenas: Vec<u64> = Vec::new();
        for (index, transient) in transients.iter().enumerate() {
            let Some(Transient { bytes, lifetime: (first, last) }) = *transient else { continue };
            let bytes = padded(bytes);
            let in_the_way = |arena: u32| {
                let earlier = placement[..index].iter().zip(transients);
                let mut taken: Vec<_> = earlier
                    .filter_map(|(place, other)| {
                        let (place, other) = (place.filter(|place| place.arena == arena)?, (*other)?);
                        let meets = other.lifetime.0 <= last && first <= other.lifetime.1;
                        meets.then(|| (place.offset, place.offset + padded(other.bytes)))
                    })
                    .collect();
                taken.sort_unstable();
                taken.iter().fold(0, |at, &(from, to)| if at + bytes <= from { at } else { at.max(to) })
            };
            let fits = |&arena: &u32| in_the_way(arena) + bytes <= ARENA_BYTES || in_the_way(arena) == 0;
            let arena = (0..).find(fits).expect("an empty arena takes everything");
            let offset = in_the_way(arena);
            arenas.resize(arenas.len().max(arena as usize + 1), 0);
            arenas[arena as usize] = arenas[arena as usize].max(offset + bytes);
            placement[index] = Some(Placement { arena, offset });
        }
        (placement, arenas)
    }

    fn transient(bytes: u64, lifetime: (u32, u32)) -> Option<Transient> {
        Some(Transient { bytes, lifetime })
    }

    #[test]
    fn a_gap_is_filled_and_a_full_arena_is_followed_by_another() {
        let list = [
            transient(1000, (0, 1)),
            transient(300, (0, 4)),
            None,
            transient(256, (2, 3)),
            transient(ARENA_BYTES, (4, 5)),
            transient(2 * ARENA_BYTES, (4, 4)),
            transient(1, (5, 5)),
        ];
        let (placement, arenas) = place(list.into_iter());
        let places: Vec<_> = placement.iter().map(|p| p.map(|p| (p.arena, p.offset))).collect();
        let expected = [Some((0, 0)), Some((0, 1024)), None, Some((0, 0)), Some((1, 0)), Some((2, 0)), Some((0, 0))];
        assert_eq!(places, expected);
        assert_eq!(arenas, [1536, ARENA_BYTES, 2 * ARENA_BYTES]);
        assert_eq!((placement, arenas), reference(&list));
    }

    proptest! {
        #[test]
        fn places_are_those_of_the_specification(
            drawn in prop::collection::vec((0u64..1 << 29, 0u32..6, 0u32..30, 0u32..12, any::<bool>()), 0..80)
        ) {
            // Sizes of all magnitudes, so that both small gaps and further arenas occur.
            let list: Vec<_> = drawn
                .into_iter()
                .map(|(bytes, shift, first, more, used)| {
                    used.then_some(Transient { bytes: (bytes >> (4 * shift)).max(16), lifetime: (first, first + more) })
                })
                .collect();
            prop_assert_eq!(place(list.iter().copied()), reference(&list));
        }
    }
}
