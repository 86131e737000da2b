//! Fibre directions on maps: a symbol for the projection on the surface, text for the angles.

use crate::output::plot::{Anchor, Canvas};
use crate::output::surface_properties::{SurfaceFibre, SurfaceProperties};

const RADIUS: f64 = 17.0;
const COLOUR: &str = "#8b0000";
/// Fibres within this angle of the normal, radians, are drawn along the normal. Fibres within this angle of the surface get no
/// arrowhead.
const UPRIGHT_TOLERANCE_RAD: f64 = 1e-3;

/// Draws a symbol for each fibre, from the given point to the left. The length of a line is proportional to the cosine
/// of the tilt. An arrowhead marks the fibre end that rises out of body 1. A dot in a ring marks a fibre along the
/// normal.
pub(super) fn draw_fibre_symbols(canvas: &mut Canvas, surface: &SurfaceProperties, [x, y]: [f64; 2]) {
    for (i, fibre) in surface.fibres.iter().enumerate() {
        draw_fibre_symbol(canvas, fibre, [x - 2.4 * RADIUS * i as f64, y]);
    }
}

fn draw_fibre_symbol(canvas: &mut Canvas, fibre: &SurfaceFibre, [x, y]: [f64; 2]) {
    canvas.add(format_args!(
        r##"<circle cx="{x:.1}" cy="{y:.1}" r="{RADIUS}" fill="white" fill-opacity="0.85" stroke="#aaa"/>"##
    ));
    let (tilt, azimuth) = upward_direction(fibre);
    if std::f64::consts::FRAC_PI_2 - tilt < UPRIGHT_TOLERANCE_RAD {
        canvas.add(format_args!(r#"<circle cx="{x:.1}" cy="{y:.1}" r="2.6" fill="{COLOUR}"/>"#));
        canvas.add(format_args!(
            r#"<circle cx="{x:.1}" cy="{y:.1}" r="6.5" fill="none" stroke="{COLOUR}" stroke-width="1.6"/>"#
        ));
        return;
    }
    let half = (RADIUS - 3.0) * tilt.cos();
    // The pixel coordinate y points downwards.
    let along = [azimuth.cos(), -azimuth.sin()];
    let at = |s: f64, t: f64| [x + s * along[0] - t * along[1], y + s * along[1] + t * along[0]];
    let ([x0, y0], [x1, y1]) = (at(-half, 0.0), at(half, 0.0));
    canvas.add(format_args!(
        r#"<path d="M{x0:.1} {y0:.1}L{x1:.1} {y1:.1}" stroke="{COLOUR}" stroke-width="2"/>"#
    ));
    if tilt > UPRIGHT_TOLERANCE_RAD {
        let ([ax, ay], [bx, by]) = (at(half - 5.0, 3.5), at(half - 5.0, -3.5));
        canvas.add(format_args!(
            r#"<path d="M{x1:.1} {y1:.1}L{ax:.1} {ay:.1}L{bx:.1} {by:.1}z" fill="{COLOUR}"/>"#
        ));
    }
}

/// Tilt and azimuth of the fibre end that rises out of the surface.
fn upward_direction(fibre: &SurfaceFibre) -> (f64, f64) {
    if fibre.tilt < 0.0 {
        (-fibre.tilt, fibre.azimuth + std::f64::consts::PI)
    } else {
        (fibre.tilt, fibre.azimuth)
    }
}

/// Text with the tilt and azimuth of each fibre in degrees, as in the scene. `azimuth` is the azimuth of the frame, radians.
pub(super) fn fibre_labels(surface: &SurfaceProperties, azimuth: f64) -> Vec<String> {
    let degrees = |angle: f64| {
        let rounded = (angle.to_degrees() * 100.0).round() / 100.0;
        // Adding 0 turns -0 into 0.
        format!("{}\u{b0}", rounded + 0.0).replace('-', "\u{2212}")
    };
    let line = |fibre: &SurfaceFibre| {
        let turned = fibre.azimuth + azimuth;
        format!("fibres of {}: tilt {}, azimuth {}", fibre.side.name(), degrees(fibre.tilt), degrees(turned))
    };
    surface.fibres.iter().map(line).collect()
}

pub(super) fn write_words(canvas: &mut Canvas, lines: &[String], [x, y]: [f64; 2]) {
    canvas.add(format_args!(r#"<g fill="{COLOUR}">"#));
    for (i, line) in lines.iter().enumerate() {
        canvas.text([x, y + 14.0 * i as f64], Anchor::Start, 11.0, line);
    }
    canvas.add(format_args!("</g>"));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Side;

    /// Truth: a fibre with tilt t and azimuth a has the direction (cos t cos a, cos t sin a, sin t). A fibre with
    /// negative tilt rises in the direction opposite to its azimuth. The text shows the angles of the scene.
    #[test]
    fn signs_and_words_follow_the_angles() {
        let fibre = |tilt: f64, azimuth: f64| SurfaceFibre {
            side: Side::Lower,
            tilt: tilt.to_radians(),
            azimuth: azimuth.to_radians(),
        };
        let (tilt, azimuth) = upward_direction(&fibre(-30.0, 10.0));
        assert!((tilt.to_degrees() - 30.0).abs() < 1e-12 && (azimuth.to_degrees() - 190.0).abs() < 1e-12);
        let surface = SurfaceProperties { fibres: vec![fibre(-30.0, 35.0)], ..SurfaceProperties::default() };
        assert_eq!(
            fibre_labels(&surface, 10_f64.to_radians()),
            ["fibres of body 1: tilt \u{2212}30\u{b0}, azimuth 45\u{b0}"]
        );
        let drawn = |tilt: f64| {
            let mut canvas = Canvas::default();
            draw_fibre_symbol(&mut canvas, &fibre(tilt, 90.0), [100.0, 50.0]);
            canvas.into_svg([1.0, 1.0])
        };
        // At a tilt of 60 degrees, the line along y has half its full length. Pixel coordinates count downwards.
        assert!(drawn(60.0).contains("M100.0 57.0L100.0 43.0"), "{}", drawn(60.0));
        assert!(drawn(0.0).contains("M100.0 64.0L100.0 36.0") && !drawn(0.0).contains("z\""));
        assert!(drawn(90.0).contains(r#"r="6.5""#));
    }
}
