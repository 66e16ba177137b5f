use super::*;

#[test]
fn forces_and_their_moments_are_compared_with_all_that_act() {
    let mut pushed = Resultant::default();
    pushed.add(&[0.0, 0.0, -3.0], [2.0, 0.0, 1.0]);
    assert_eq!(pushed, Resultant { force: [0.0, 0.0, -3.0], moment: [0.0, 6.0, 0.0] });
    let mut held = Resultant::default();
    held.add(&[0.0, 0.0, 3.0], [0.5, 0.0, -1.0]);
    let tips = BodyBalance { loads: pushed, supports: held, gross: 6.0, radius: 2.0, ..BodyBalance::default() };
    // Forces are in balance, the moment 3 x 1.5 is not: over the radius and all forces.
    assert_eq!(relative(&[tips], 0.0), 4.5 / 2.0 / 6.0);
    assert_eq!(relative(&[tips], 60.0), 4.5 / 2.0 / 60.0);
    let stands = BodyBalance { contacts: Resultant { moment: [0.0, -4.5, 0.0], ..Resultant::default() }, ..tips };
    assert_eq!(relative(&[stands, BodyBalance { radius: 1.0, ..BodyBalance::default() }], 0.0), 0.0);
    assert_eq!(relative(&[], 0.0), 0.0);
}
