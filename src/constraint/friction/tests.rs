use super::*;

#[test]
fn directions_are_orthonormal_and_leave_out_what_is_held() {
    let free = [true; 3];
    for normal in [[0.0, 0.0, -1.0], [0.6, 0.0, 0.8], [0.48, -0.6, 0.64], [1.0, 0.0, 0.0]] {
        let found = directions(normal, free, &[]);
        assert_eq!(found.len(), 2);
        let all = [normal, found[0], found[1]];
        for (i, a) in all.iter().enumerate() {
            for (j, b) in all.iter().enumerate() {
                assert!((dot(*a, *b) - f64::from(i == j)).abs() < 1e-15, "{all:?}");
            }
        }
        // Held along y: one direction, orthogonal to y.
        if normal[1] == 0.0 {
            let found = directions(normal, [true, false, true], &[]);
            assert_eq!((found.len(), found[0][1]), (1, 0.0));
        }
        assert!(directions(normal, [false, false, true], &[]).len() <= 1);
    }
    // At an edge: along it.
    let found = directions([0.0, 0.0, 1.0], free, &[[1.0, 0.0, 0.0]]);
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].map(f64::abs), [0.0, 1.0, 0.0]);
    assert!(directions([0.0, 0.0, 1.0], free, &[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]).is_empty());
}
