use super::{cluster, groups, levels, subdomains};

#[test]
fn there_are_as_many_levels_as_the_coarse_problem_needs() {
    let of = |boxes: usize, cells: u64, thin| groups(boxes, 6 * cells.pow(3) * boxes as u64, thin);
    let groups = |boxes: usize, cells: u64| of(boxes, cells, false);
    assert!(groups(48, 10).is_empty());
    assert_eq!(groups(1296, 5), [8]);
    for boxes in [6000, 20_250, 93_750] {
        assert_eq!(groups(boxes, 2), [8, 8], "{boxes}");
    }
    assert_eq!(groups(1_000_000, 2), [8; 4]);
    assert_eq!((of(6000, 2, true), of(93_750, 2, true)), (vec![8], vec![8, 8]));
    assert_eq!((levels(6000, 8), levels(93_750, 27), levels(10, 1)), (vec![8], vec![27; 2], vec![]));
}

#[test]
fn many_small_subdomains_share_rigid_motions() {
    // Boxes, the cells of their edge, and the size of the clusters that was fastest (384 and 750 of 4 cells: as fast as another).
    for (boxes, cells, fastest) in [
        (48, 5, 1),
        (48, 10, 1),
        (162, 10, 1),
        (384, 5, 1),
        (750, 4, 8),
        (750, 2, 8),
        (1296, 5, 8),
        (6000, 2, 8),
        (20_250, 2, 27),
    ] {
        assert_eq!(cluster(boxes, 6 * cells * cells * cells * boxes as u64), fastest, "{boxes} boxes");
    }
}

/// Times of runs by the number of subdomains, in seconds.
#[test]
fn the_number_of_subdomains_is_within_a_tenth_of_the_fastest() {
    type Scan = (u64, &'static [(usize, f64)]);
    let scans: [Scan; 6] = [
        // The benchmark, level 2, of tet4 and hex8; level 1 of tet10.
        (288_000, &[(78, 3.70), (120, 3.39), (180, 3.35), (260, 3.52), (350, 3.80)]),
        (288_000, &[(50, 6.03), (90, 5.52), (140, 5.19), (200, 5.17)]),
        (288_000, &[(24, 10.24), (48, 6.78), (80, 5.30), (120, 5.07), (180, 4.67)]),
        // A housing of tet4, 30, 90 and 260 thousand nodes.
        (133_986, &[(21, 1.94), (42, 1.49), (84, 1.39), (126, 1.31), (168, 1.25)]),
        (449_662, &[(111, 6.22), (180, 5.24), (250, 5.11), (350, 5.25), (500, 6.05)]),
        (1_382_406, &[(273, 34.33), (500, 20.82), (800, 21.56)]),
    ];
    for (elements, times) in scans {
        let found = subdomains(elements, 1);
        let after = times.iter().position(|time| time.0 >= found).expect("the scan goes far enough");
        let [(low, before), (high, behind)] = [times[after - 1], times[after]];
        let time = before + (behind - before) * (found - low) as f64 / (high - low) as f64;
        let least = times.iter().map(|time| time.1).fold(f64::INFINITY, f64::min);
        assert!(time <= 1.1 * least, "{elements} elements in {found} subdomains: {time} s, {least} s at best");
    }
}

#[test]
fn subdomains_grow_with_the_mesh_and_slower() {
    assert_eq!([1, 1000, 36_000, 288_000, 2_304_000].map(|n| subdomains(n, 1)), [1, 1, 26, 179, 946]);
    assert_eq!(subdomains(1000, 7), 7);
}
