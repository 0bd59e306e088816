//! Sorting by a number. One sort serves all types: each of its own would be compiled anew.

/// Sorts by a number, the least first; equal ones stay in their order.
pub fn by_least<T>(items: &mut Vec<T>, number: impl Fn(&T) -> f64) {
    let order = from_least(&items.iter().map(number).collect::<Vec<f64>>());
    let mut taken: Vec<Option<T>> = std::mem::take(items).into_iter().map(Some).collect();
    items.extend(order.into_iter().filter_map(|place| taken[place].take()));
}

/// The places of some numbers, that of the least first.
pub fn from_least(numbers: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..numbers.len()).collect();
    order.sort_by(|a, b| numbers[*a].total_cmp(&numbers[*b]));
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_comes_first_and_equals_stay_in_their_order() {
        let mut items = vec![("b", 2.0), ("a", -1.0), ("c", 2.0), ("d", f64::NAN), ("e", 0.5)];
        by_least(&mut items, |item| item.1);
        assert_eq!(items.iter().map(|item| item.0).collect::<String>(), "aebcd");
    }
}
