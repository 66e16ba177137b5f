use super::*;
use crate::random::Random;

fn assert_near(a: &Voigt, b: &Voigt, tolerance: f64) {
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance), "{a:?} {b:?}");
}

#[test]
fn polynomials_are_found_and_moved_whatever_the_unit_of_length() {
    let mut random = Random::new(1);
    for n in [4, 10] {
        for size in [1e-6, 1.0, 1e6] {
            let row = |k: usize| random.vector::<6>(1.0).map(|c| c * f64::powi(size, -DEGREES[k]));
            let exact = (0..n).flat_map(row).collect::<Vec<f64>>();
            let mut sums = vec![0.0; width(n)];
            for _ in 0..40 {
                let way = random.vector(size);
                add(n, way, &value(&exact, way), &mut sums);
            }
            let mut found = vec![0.0; 6 * n];
            assert!(fit(n, &sums, &mut found));
            for _ in 0..5 {
                let (way, step): ([f64; 3], [f64; 3]) = (random.vector(size), random.vector(size));
                assert_near(&value(&found, way), &value(&exact, way), 1e-7);
                let beyond = std::array::from_fn(|i| way[i] + step[i]);
                let mut moved = vec![0.0; 6 * n];
                add_moved(&found, way, &mut moved);
                assert_near(&value(&moved, step), &value(&found, beyond), 1e-13);
            }
        }
    }
}

#[test]
fn along_ways_without_samples_it_is_nearly_constant() {
    let mut sums = vec![0.0; width(4)];
    for (x, y) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -2.0)] {
        add(4, [x, y, 0.5], &[3.0 + 2.0 * x - y, 1.0, 0.0, 0.0, 0.0, 0.0], &mut sums);
    }
    let mut found = vec![0.0; 24];
    assert!(!fit(4, &sums, &mut found));
    for z in [-1.0, 0.5, 1.0] {
        assert_near(&value(&found, [0.3, 0.2, z]), &[3.4, 1.0, 0.0, 0.0, 0.0, 0.0], 0.05);
    }
}
