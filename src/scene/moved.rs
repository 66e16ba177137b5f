//! How far supports and obstacles are moved at one time of a load history.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{Scene, Step};

/// Displacements by name (length); what is not named is where it was at rest.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Moved {
    /// Of supports.
    pub support: BTreeMap<String, [f64; 3]>,
    /// Of the obstacles of contacts.
    pub contact: BTreeMap<String, [f64; 3]>,
}

impl Moved {
    /// At the end of a step.
    pub fn at_end(scene: &Scene, step: &Step) -> Self {
        let times = |factor: f64, displacement: [f64; 3]| displacement.map(|d| factor * d);
        let supports = scene.support.iter().map(|(name, support)| {
            (name.clone(), times(step.of_support(name), support.displacement.unwrap_or_default()))
        });
        let contacts = scene.contact.iter();
        let contacts =
            contacts.map(|(name, contact)| (name.clone(), times(step.of_contact(name), contact.displacement())));
        Self { support: supports.collect(), contact: contacts.collect() }
    }

    /// At a time, which is the number of steps done with the fraction of the present one, on the way from `self`.
    pub fn until(self, scene: &Scene, time: f64) -> Self {
        let steps = scene.steps();
        let done = (time.max(0.0) as usize).min(steps.len());
        let before = done.checked_sub(1).map_or(self, |last| Self::at_end(scene, &steps[last]));
        match (steps.get(done), time - done as f64) {
            (Some(step), fraction) if fraction > 0.0 => before.towards(Self::at_end(scene, step), fraction),
            _ => before,
        }
    }

    /// A fraction of the way to an end, for what is named there.
    fn towards(&self, mut end: Self, fraction: f64) -> Self {
        for (ends, from) in [(&mut end.support, &self.support), (&mut end.contact, &self.contact)] {
            for (name, at) in ends {
                let from = from.get(name).copied().unwrap_or_default();
                *at = std::array::from_fn(|a| from[a] + fraction * (at[a] - from[a]));
            }
        }
        end
    }

    /// Without what is on other bodies than these of the scene.
    pub fn on(mut self, scene: &Scene, is_on: impl Fn(&str) -> bool) -> Self {
        self.support.retain(|name, _| scene.support.get(name).is_some_and(|support| is_on(&support.surface.body)));
        let touches = |name: &String| scene.contact.get(name).is_some_and(|c| c.surfaces().any(|s| is_on(&s.body)));
        self.contact.retain(|name, _| touches(name));
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn displacements_follow_their_factors_in_straight_lines() {
        let text = "step = [{ amplitude = 2.0, increments = 2 }, { support.top = -1.0 }]\n\
            [material.m]\nyoung = 1.0\npoisson = 0.3\n\
            [body.a]\nmaterial = \"m\"\nelement = \"hex8\"\nbrick = { origin = [0, 0, 0], size = [1, 1, 1], cells = [1, 1, 1] }\n\
            [support.top]\nsurface = \"a.zmax\"\nfix = [\"x\", \"y\", \"z\"]\ndisplacement = [0.0, 0.0, 3.0]\n\
            [contact.roller]\nslave = \"a.zmin\"\ndisplacement = [1.0, 0.0, 0.0]\n\
            rigid = { plane = { point = [0, 0, 0], normal = [0, 0, 1] } }\n";
        let scene = Scene::from_text(text, "one.toml", 1, &[]).expect("a sound scene");
        let at = |start: &Moved, time: f64| {
            let moved = start.clone().until(&scene, time);
            (moved.support["top"][2], moved.contact["roller"][0])
        };
        let rest = Moved::default();
        assert_eq!([0.5, 1.0, 1.5, 2.0].map(|time| at(&rest, time)), [(3.0, 1.0), (6.0, 2.0), (1.5, 1.5), (-3.0, 1.0)]);
        let earlier = Moved { support: [("top".into(), [0.0, 0.0, 4.0])].into(), ..Moved::default() };
        assert_eq!([at(&earlier, 0.5), at(&earlier, 1.0)], [(5.0, 1.0), (6.0, 2.0)]);
        assert_eq!(earlier.clone().until(&scene, 0.0), earlier);
        assert_eq!(earlier.clone().on(&scene, |body| body == "a"), earlier);
        assert_eq!(earlier.on(&scene, |body| body != "a"), rest);
    }
}
