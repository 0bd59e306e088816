//! Which starts of a dense grid are looked at: coarse first, then round the best.

use super::screening::Start;

/// Of so many neighbouring sizes one is looked at first. Origin: 14 drawn cases and two rigs; it takes 0.84 and 0.88
/// of the steps, and no name changes.
const EVERY: usize = 3;
/// Grids of fewer sizes are not dense: between two of them lies more than a refinement could find again. Origin: the
/// dense grid of a backlash has 20 sizes a factor of 1.3 apart, the other one 8, a factor of two and more apart.
const DENSE: usize = 12;

/// What the starts of a grid promise. Starts with the same first parameter, a size, stand together, in the order of their sizes.
pub(super) fn screened<'g>(grid: &[&'g Vec<f64>], ask: impl Fn(&[&'g Vec<f64>]) -> Vec<Start>) -> Vec<Start> {
    let sizes: Vec<&[&Vec<f64>]> = grid.chunk_by(|a, b| a[0] == b[0]).collect();
    if sizes.len() < DENSE {
        return ask(grid);
    }
    let coarse: Vec<usize> = (EVERY / 2..sizes.len()).step_by(EVERY).collect();
    let of = |places: &[usize]| places.iter().flat_map(|place| sizes[*place]).copied().collect::<Vec<_>>();
    let rows = of(&coarse);
    let mut starts = ask(&rows);
    let best = starts.iter().zip(&rows).min_by(|a, b| a.0.predicted_cost.total_cmp(&b.0.predicted_cost));
    let Some(size) = best.and_then(|(_, row)| sizes.iter().position(|size| size[0][0] == row[0])) else {
        return starts;
    };
    let near = size.saturating_sub(EVERY / 2)..=(size + EVERY / 2).min(sizes.len() - 1);
    let near: Vec<usize> = near.filter(|place| !coarse.contains(place)).collect();
    starts.extend(ask(&of(&near)));
    starts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn start(predicted_cost: f64, x: &[f64]) -> Start {
        Start { predicted_cost, optimistic_cost: predicted_cost, x: x.to_vec(), part: x.to_vec() }
    }

    /// Sizes that are looked at, where the promise is best at one of twenty.
    fn looked_at(sizes: usize, best: f64) -> Vec<usize> {
        let rows: Vec<Vec<f64>> = (0..2 * sizes).map(|k| vec![(k / 2) as f64, (k % 2) as f64]).collect();
        let grid: Vec<&Vec<f64>> = rows.iter().collect();
        let look = |rows: &[&Vec<f64>]| rows.iter().map(|row| start((row[0] - best).abs(), row)).collect();
        let mut places: Vec<usize> = screened(&grid, look).iter().map(|start| start.x[0] as usize).collect();
        places.sort_unstable();
        assert!(places.chunks(2).all(|both| both[0] == both[1]), "a size without all its starts");
        places.dedup();
        places
    }

    #[test]
    fn a_dense_grid_is_looked_at_coarsely_and_round_its_best_size() {
        assert_eq!(looked_at(20, 8.0), [1, 4, 6, 7, 8, 10, 13, 16, 19]);
        assert_eq!(looked_at(20, 19.0), [1, 4, 7, 10, 13, 16, 18, 19]);
        assert_eq!(looked_at(20, 0.0), [0, 1, 2, 4, 7, 10, 13, 16, 19]);
    }

    #[test]
    fn a_grid_of_few_sizes_is_looked_at_as_a_whole() {
        assert_eq!(looked_at(8, 5.0), [0, 1, 2, 3, 4, 5, 6, 7]);
    }
}
