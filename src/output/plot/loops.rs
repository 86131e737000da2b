//! Fretting loops: tangential force over tangential displacement, with the energy dissipated per cycle.

use crate::evolution::records::FrettingLoop;
use crate::output::plot::axis::Scale;
use crate::output::plot::chart::{Chart, Series};
use crate::output::summary::Units;

/// Fretting loop of one cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopCurve {
    /// Label, such as "fretting, after 50000 cycles".
    pub label: String,
    /// Displacement of body 2 from the centre of the stroke (mm) and tangential force on body 1 (N), both along the stroke, in
    /// order. The last point is joined to the first.
    pub points: Vec<[f64; 2]>,
    /// Energy dissipated by friction in the cycle, N mm: the area of the loop if the bodies move only along the stroke.
    pub dissipated_energy: f64,
}

impl LoopCurve {
    /// Loop of a recorded cycle, along the direction of the largest displacement from the centre of the stroke.
    pub fn of(cycle: &FrettingLoop) -> Self {
        let far = |a: &&[f64; 5], b: &&[f64; 5]| a[0].hypot(a[1]).total_cmp(&b[0].hypot(b[1]));
        let end = cycle.points.iter().max_by(far).copied().unwrap_or_default();
        let length = end[0].hypot(end[1]);
        let [x, y] = if length > 0.0 { [end[0] / length, end[1] / length] } else { [1.0, 0.0] };
        let along = |point: &[f64; 5]| [point[0] * x + point[1] * y, point[2] * x + point[3] * y];
        Self {
            label: format!("{}, after {} cycles", cycle.name, cycle.cycles_done),
            points: cycle.points.iter().map(along).collect(),
            dissipated_energy: cycle.dissipation,
        }
    }

    /// Enclosed area. It is positive for friction: the force on body 1 has the sign of the motion of body 2.
    pub fn area(&self) -> f64 {
        let next = self.points.iter().cycle().skip(1);
        0.5 * self.points.iter().zip(next).map(|(a, b)| b[0] * a[1] - a[0] * b[1]).sum::<f64>()
    }
}

/// Draws loops in one chart. The legend shows the dissipated energy.
pub fn loops_svg(loops: &[LoopCurve], units: &Units) -> String {
    let series = loops.iter().map(|cycle| Series {
        name: format!(
            "{}: {} {} {}",
            cycle.label,
            four_digits(cycle.dissipated_energy),
            units.force,
            units.length
        ),
        points: cycle.points.iter().chain(cycle.points.first()).copied().collect(),
    });
    let chart = Chart {
        title: "Fretting loops and dissipated energy".to_owned(),
        labels: [
            format!("tangential displacement along the stroke, {}", units.length),
            format!("tangential force on body 1 along the stroke, {}", units.force),
        ],
        scales: [Scale::Linear, Scale::Linear],
        series: series.collect(),
    };
    chart.svg()
}

/// Formats a number with four significant digits. Magnitudes from 1e4 to 1e6 give an integer. Magnitudes below 1e-3 or
/// from 1e6 get a power of ten.
pub(crate) fn four_digits(value: f64) -> String {
    let digits = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
    if (-3..6).contains(&digits) {
        return format!("{value:.*}", (3 - digits).max(0) as usize).replace('-', "\u{2212}");
    }
    let text = format!("{:.3}", value / 10_f64.powi(digits)).replace('-', "\u{2212}");
    format!("{text}\u{b7}10^{{{digits}}}").replace("{-", "{\u{2212}")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Loop of a spring of stiffness k with a friction element: elastic up to ± F, then sliding up to amplitude a.
    fn parallelogram(amplitude: f64, force: f64, stiffness: f64) -> LoopCurve {
        let elastic = 2.0 * force / stiffness;
        let points = vec![
            [amplitude, force],
            [amplitude - elastic, -force],
            [-amplitude, -force],
            [elastic - amplitude, force],
        ];
        LoopCurve {
            label: "cycle 1".into(),
            points,
            dissipated_energy: 4.0 * force * (amplitude - force / stiffness),
        }
    }

    /// Truth: a spring (stiffness k) with a friction element (force F) has a loop of area 4 F (a - F / k) at the
    /// amplitude a.
    #[test]
    fn the_area_is_the_energy_of_a_slider_on_a_spring() {
        let cycle = parallelogram(0.08, 120.0, 6000.0);
        assert!((cycle.area() - 28.8).abs() < 1e-12, "{}", cycle.area());
        assert!((cycle.dissipated_energy - 28.8).abs() < 1e-12);
    }

    /// Truth: pixels are proportional to displacements and forces. The curve is closed, and the legend shows the energy.
    #[test]
    fn loops_are_closed_and_named() {
        let cycles = [parallelogram(5.0, 100.0, 100.0), parallelogram(5.0, 50.0, 100.0)];
        let picture = loops_svg(&cycles, &Units::default());
        assert!(
            picture.contains("cycle 1: 1600 N mm") && picture.contains("cycle 1: 900.0 N mm"),
            "{picture}"
        );
        let line = picture.lines().find(|line| line.contains("stroke-width=\"1.8\"") && line.contains('L'));
        let line = line.expect("a curve");
        let path = line.split('"').nth(1).expect("a path").trim_start_matches('M');
        let points: Vec<[f64; 2]> = path
            .split('L')
            .map(|point| {
                let (x, y) = point.split_once(' ').expect("a pair");
                [x.parse().expect("a number"), y.parse().expect("a number")]
            })
            .collect();
        assert_eq!((points.len(), points[0]), (5, points[4]));
        // The displacements are 5, 3, -5 and -3. The forces, positive upwards in the figure, are 100, -100, -100
        // and 100.
        let share = (points[0][0] - points[1][0]) / (points[0][0] - points[2][0]);
        assert!((share - 0.2).abs() < 2e-3, "{points:?}");
        assert!(points[0][1] < points[1][1] && (points[1][1] - points[2][1]).abs() < 0.11);
    }

    #[test]
    fn energies_are_short() {
        let texts = [28.8, 0.0, -0.001_234_56, 1.5e-7, 2.0e8].map(four_digits);
        assert_eq!(
            texts,
            ["28.80", "0.000", "\u{2212}0.001235", "1.500\u{b7}10^{\u{2212}7}", "2.000\u{b7}10^{8}"]
        );
    }
}
