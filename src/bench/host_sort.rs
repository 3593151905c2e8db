//! What the device's sort is compared with.

/// Sorts pairs by their keys: least significant digit first, one thread, all histograms in one read, as good as plain
/// code gets. `spare` is as long as `pairs`.
pub(super) fn sort_pairs(pairs: &mut Vec<[u32; 2]>, spare: &mut Vec<[u32; 2]>) {
    let mut histograms = [[0u32; 256]; 4];
    for [key, _] in pairs.iter() {
        for (pass, histogram) in histograms.iter_mut().enumerate() {
            histogram[(key >> (8 * pass) & 255) as usize] += 1;
        }
    }
    for (pass, histogram) in histograms.iter().enumerate() {
        let mut sum = 0u32;
        let mut places = histogram.map(|count| {
            sum += count;
            sum - count
        });
        for &pair in pairs.iter() {
            let place = &mut places[(pair[0] >> (8 * pass) & 255) as usize];
            spare[*place as usize] = pair;
            *place += 1;
        }
        std::mem::swap(pairs, spare);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_are_sorted_and_equal_keys_keep_their_order() {
        let mut pairs: Vec<[u32; 2]> = (0..5000u32).map(|i| [i.wrapping_mul(2_654_435_761) >> (i % 32), i]).collect();
        let mut wanted = pairs.clone();
        wanted.sort_by_key(|pair| pair[0]);
        let mut spare = pairs.clone();
        sort_pairs(&mut pairs, &mut spare);
        assert_eq!(pairs, wanted);
    }
}
