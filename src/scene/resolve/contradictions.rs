//! Supports of a body that contradict one another, at the keys that they stand under.

use std::collections::HashMap;

use super::Resolver;
use crate::geometry::{number, place};
use crate::scene::plan::{MeshedSpec, Support};

const NAMES: [&str; 3] = ["x", "y", "z"];

/// Reports each support that prescribes another displacement at a node than one before it; their number.
pub(super) fn report(r: &mut Resolver, spec: &MeshedSpec) -> usize {
    let mut known: HashMap<(usize, usize), (usize, f64)> = HashMap::new();
    let mut count = 0;
    for (index, support) in spec.supports.iter().enumerate() {
        let Ok(nodes) = spec.mesh.group_nodes(&support.group) else { continue };
        let mut found = None;
        for node in nodes {
            for component in 0..3 {
                let Some(value) = prescribed(support, component, &spec.mesh.points[node]) else { continue };
                let (earlier, before) = *known.entry((node, component)).or_insert((index, value));
                if before != value && found.is_none() {
                    found = Some((earlier, node, component, [before, value]));
                }
            }
        }
        if let Some((earlier, node, component, values)) = found {
            let other = &spec.supports[earlier];
            let groups = if other.group == support.group {
                format!("both name the group \"{}\"", support.group)
            } else {
                format!("(groups \"{}\" and \"{}\") share nodes", other.group, support.group)
            };
            let message = format!(
                "{} and {} {groups} but prescribe different displacements along {}: {} and {} at {}",
                other.key,
                support.key,
                NAMES[component],
                number(values[0]),
                number(values[1]),
                place(&spec.mesh.points[node])
            );
            let mend = format!("remove {} from `components` of one of them", NAMES[component]);
            r.wrong(&support.key, message, "this support", mend);
            count += 1;
        }
    }
    count
}

/// The displacement that a support prescribes along a component at a point.
fn prescribed(support: &Support, component: usize, at: &[f64; 3]) -> Option<f64> {
    let far: f64 = support.gradient[component].iter().zip(at).map(|(g, x)| g * x).sum();
    support.values[component].map(|value| value + far)
}
