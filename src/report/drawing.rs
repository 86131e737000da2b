//! Plan view of the contact frame, drawn to scale.

use serde_json::Value;

use crate::output::plot::colour::SERIES_COLOURS;
use crate::output::plot::{Anchor, Canvas};
use crate::output::summary::Units;
use crate::report::value_text::with_unit;

/// Width of the drawing, and its height with up to three lines in the legend, pixels.
const TOP_VIEW_PX: [f64; 2] = [400.0, 360.0];
const CENTER_PX: [f64; 2] = [200.0, 172.0];
const FILL: &str = "#e8e4d8";

/// Colours of the lines and their descriptions.
type Legend = Vec<(&'static str, String)>;

/// Draws the frame as seen from body 2, with fibres, motions and forces.
pub(super) fn top_view_svg(scene: &Value, units: &Units) -> String {
    let mut canvas = Canvas::default();
    let frame = &scene["frame"];
    let half = pair(&frame["half_width"]).filter(|half| half.iter().all(|side| *side > 0.0));
    let half = half.unwrap_or([1.0, 1.0]);
    let scale = 115.0 / half[0].max(half[1]);
    let turn = frame["azimuth"].as_f64().unwrap_or(0.0);
    let [w, h] = half.map(|side| side * scale);
    canvas.add(format_args!(
        r#"<g transform="translate({} {}) rotate({})">"#,
        CENTER_PX[0], CENTER_PX[1], -turn
    ));
    let edge = SERIES_COLOURS[1];
    canvas.add(format_args!(
        r#"<rect x="{:.1}" y="{:.1}" width="{:.1}" height="{:.1}" fill="{FILL}" stroke="{edge}" stroke-width="3"/>"#,
        -w, -h, 2.0 * w, 2.0 * h
    ));
    outline(&mut canvas, &frame["outline"], scale);
    canvas.add(format_args!("</g>"));
    let mut legend = Legend::new();
    draw_fibres(&mut canvas, scene, &mut legend);
    draw_motions(&mut canvas, scene, turn, &mut legend);
    draw_legend(&mut canvas, &legend);
    canvas.text(
        [200.0, 18.0],
        Anchor::Middle,
        12.0,
        &format!(
            "frame from above, half-widths {}",
            with_unit(units, "half_width", &frame["half_width"]).replace('–', "by its mesh")
        ),
    );
    canvas.add(format_args!(
        r##"<path d="M336 290H370M336 290V256" stroke="#222" stroke-width="1.5" fill="none"/>"##
    ));
    canvas.text([374.0, 294.0], Anchor::Start, 12.0, "x");
    canvas.text([332.0, 248.0], Anchor::Start, 12.0, "y");
    canvas.into_svg([TOP_VIEW_PX[0], TOP_VIEW_PX[1] + 14.0 * legend.len().saturating_sub(3) as f64])
}

fn pair(value: &Value) -> Option<[f64; 2]> {
    let list = value.as_array()?;
    Some([list.first()?.as_f64()?, list.get(1)?.as_f64()?])
}

fn draw_fibres(canvas: &mut Canvas, scene: &Value, legend: &mut Legend) {
    for (i, key) in ["body1", "body2"].into_iter().enumerate() {
        let fibre = &scene[key]["fibre"];
        let tilt = fibre["tilt"].as_f64();
        if let Some(tilt) = tilt {
            let azimuth = fibre["azimuth"].as_f64().unwrap_or(0.0);
            let length = 90.0 * tilt.to_radians().cos();
            let colour = [SERIES_COLOURS[2], SERIES_COLOURS[3]][i];
            ray(canvas, azimuth, [-length, length], colour, "2.5");
            legend.push((colour, format!("fibres of body {}, projected", i + 1)));
        }
    }
}

/// Draws the direction of the force or motion of each step. `turn` is the azimuth of the frame, degrees.
fn draw_motions(canvas: &mut Canvas, scene: &Value, turn: f64, legend: &mut Legend) {
    for step in scene["steps"].as_array().into_iter().flatten() {
        let name = step["name"].as_str().unwrap_or("step");
        let force = pair(&step["tangential_force"]).filter(|q| q[0] != 0.0 || q[1] != 0.0);
        let angle = |key: &str| step[key].is_object().then(|| step[key]["angle"].as_f64().unwrap_or(0.0));
        let direction = force.map(|q| q[1].atan2(q[0]).to_degrees());
        let direction = direction.or(angle("shift")).or(angle("cycles")).or(angle("sliding"));
        if let Some(direction) = direction
            && legend.len() < 5
        {
            let from = if step["cycles"].is_object() { -60.0 } else { 0.0 };
            ray(canvas, turn + direction, [from, 60.0], SERIES_COLOURS[0], "4");
            legend.push((SERIES_COLOURS[0], format!("{name}: motion of body 2 or force")));
        }
    }
}

fn draw_legend(canvas: &mut Canvas, legend: &Legend) {
    for (i, (colour, words)) in legend.iter().enumerate() {
        let y = 306.0 + 14.0 * i as f64;
        canvas.add(format_args!(r#"<path d="M14 {:.1}h22" stroke="{colour}" stroke-width="3"/>"#, y - 4.0));
        canvas.text([42.0, y], Anchor::Start, 11.0, words);
    }
}

/// Draws a line through the centre of the frame, at an angle of `degrees` from x. Its ends lie at the two signed
/// distances `ends` from the centre. If the second distance is positive, an arrowhead marks this end.
fn ray(canvas: &mut Canvas, degrees: f64, ends: [f64; 2], colour: &str, width: &str) {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let at = |s: f64| format!("{:.1} {:.1}", CENTER_PX[0] + s * cos, CENTER_PX[1] - s * sin);
    canvas.add(format_args!(
        r#"<path d="M{}L{}" stroke="{colour}" stroke-width="{width}" stroke-linecap="round"/>"#,
        at(ends[0]),
        at(ends[1])
    ));
    if ends[1] > 0.0 {
        canvas.add(format_args!(
            r#"<path d="M0 0l-11 -5v10z" transform="translate({}) rotate({:.1})" fill="{colour}"/>"#,
            at(ends[1] + 7.0),
            -degrees
        ));
    }
}

/// Draws the outline of a punch in the axes of the frame.
fn outline(canvas: &mut Canvas, outline: &Value, scale: f64) {
    let number = |value: &Value| value.as_f64().unwrap_or(0.0) * scale;
    let [cx, cy] = [number(&outline["center"][0]), -number(&outline["center"][1])];
    let style = r##"fill="#cdd9e3" stroke="#444" stroke-dasharray="4 3""##;
    match outline["shape"].as_str() {
        Some("circle") => {
            canvas.add(format_args!(
                r#"<circle cx="{cx:.1}" cy="{cy:.1}" r="{:.1}" {style}/>"#,
                number(&outline["radius"])
            ));
        }
        Some("ellipse") => {
            let [a, b] = [0, 1].map(|i| number(&outline["semi_axes"][i]));
            let turn = -outline["angle"].as_f64().unwrap_or(0.0);
            canvas.add(format_args!(
                r#"<ellipse rx="{a:.1}" ry="{b:.1}" transform="translate({cx:.1} {cy:.1}) rotate({turn})" {style}/>"#
            ));
        }
        Some("polygon") => {
            let corners = outline["vertices"].as_array().into_iter().flatten();
            let points: Vec<String> =
                corners.map(|v| format!("{:.1},{:.1}", number(&v[0]), -number(&v[1]))).collect();
            canvas.add(format_args!(r#"<polygon points="{}" {style}/>"#, points.join(" ")));
        }
        _ => {}
    }
}
