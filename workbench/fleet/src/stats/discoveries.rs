//! Many tests at once: the rate of false alarms among all alarms.

/// The q value of each p value, in their order (Benjamini and Hochberg, J. Royal Statistical Society B 57, 1995): an alarm wherever q ≤ α
/// keeps the expected share of false ones below α for independent tests, and for positively dependent ones (Benjamini and Yekutieli, Annals of
/// Statistics 29, 2001).
pub fn q_values(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|a, b| p[*b].total_cmp(&p[*a]));
    let (mut q, mut least) = (vec![1.0; p.len()], 1.0_f64);
    for (k, &place) in order.iter().enumerate() {
        least = least.min(p[place] * p.len() as f64 / (p.len() - k) as f64);
        q[place] = least;
    }
    q
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn q_values_are_those_of_the_paper() {
        // Table of Benjamini and Hochberg 1995, section 3.2: with α = 0.05 the first four of fifteen are alarms.
        let p = [
            0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240, 0.4262, 0.5719,
            0.6528, 0.7590, 1.0,
        ];
        let q = q_values(&p);
        assert_eq!(q.iter().filter(|q| **q <= 0.05).count(), 4);
        assert!((q[3] - 0.0095 * 15.0 / 4.0).abs() < 1e-12);
        assert!(q.windows(2).all(|pair| pair[0] <= pair[1]));
    }
}
