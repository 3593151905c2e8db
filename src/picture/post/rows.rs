//! Work on rows of pixels by all cores. A row depends on the input alone, so the number of cores changes no bit.

/// Fills rows of `width` items: `fill(y, row)` for each row, shared out among the cores.
pub(super) fn for_each_row<T: Send>(items: &mut [T], width: usize, fill: impl Fn(usize, &mut [T]) + Sync) {
    let rows = items.len() / width.max(1);
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get).min(rows.max(1));
    let share = rows.div_ceil(cores).max(1);
    std::thread::scope(|scope| {
        for (index, part) in items.chunks_mut(share * width.max(1)).enumerate() {
            let fill = &fill;
            scope.spawn(move || {
                for (y, row) in part.chunks_mut(width).enumerate() {
                    fill(index * share + y, row);
                }
            });
        }
    });
}

#[cfg(test)]
mod tests {
    #[test]
    fn every_row_is_filled_once() {
        for (width, height) in [(1, 1), (3, 1), (1, 7), (4, 33), (5, 0)] {
            let mut items = vec![0usize; width * height];
            super::for_each_row(&mut items, width, |y, row| {
                row.iter_mut().enumerate().for_each(|(x, item)| *item += 1 + y * width + x);
            });
            assert_eq!(items, (1..=width * height).collect::<Vec<_>>());
        }
    }
}
