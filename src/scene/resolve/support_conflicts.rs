//! Reports contradictory supports of a body at their keys.

use std::collections::HashMap;

use super::resolver::Resolver;
use crate::geometry::{AXIS_NAMES, format_number, format_point};
use crate::scene::plan::{MeshedBodyPlan, PrescribedDisplacement};

/// Reports supports that contradict an earlier support at a node. Returns the number of these supports.
pub(super) fn report_conflicts(r: &mut Resolver, spec: &MeshedBodyPlan) -> usize {
    let mut known: HashMap<(usize, usize), (usize, f64)> = HashMap::new();
    let mut count = 0;
    for (index, support) in spec.supports.iter().enumerate() {
        let Ok(nodes) = spec.mesh.group_nodes(&support.group) else { continue };
        let mut found = None;
        for node in nodes {
            for component in 0..3 {
                let Some(value) = prescribed_value(support, component, &spec.mesh.points[node]) else {
                    continue;
                };
                let (earlier, before) = *known.entry((node, component)).or_insert((index, value));
                let other_load = value != 0.0 && spec.supports[earlier].case != support.case;
                if (before != value || other_load) && found.is_none() {
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
            let what = if values[0] == values[1] {
                "different loads".to_owned()
            } else {
                format!("{} and {}", format_number(values[0]), format_number(values[1]))
            };
            let message = format!(
                "{} and {} {groups} but prescribe different displacements along {}: {what} at {}",
                other.key,
                support.key,
                AXIS_NAMES[component],
                format_point(&spec.mesh.points[node])
            );
            let mend = format!("remove {} from `components` of one of them", AXIS_NAMES[component]);
            r.report(&support.key, message, "this support", mend);
            count += 1;
        }
    }
    count
}

fn prescribed_value(support: &PrescribedDisplacement, component: usize, at: &[f64; 3]) -> Option<f64> {
    let far: f64 = support.gradient[component].iter().zip(at).map(|(g, x)| g * x).sum();
    support.values[component].map(|value| value + far)
}
