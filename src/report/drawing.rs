//! The scene as a drawing: bodies from the side, the frame from above. Shapes are schematic, directions and the frame are to scale.

use serde_json::Value;

use crate::output::plot::colour::SERIES_COLOURS;
use crate::output::plot::{Anchor, Canvas};
use crate::report::value_text::{UnitNames, with_unit};

/// Width and height of the drawing from the side, and from above.
const SIDE_VIEW_PX: [f64; 2] = [560.0, 360.0];
const TOP_VIEW_PX: [f64; 2] = [400.0, 360.0];
/// Left, right end of the bodies, and height of the plane between them.
const BODY_SPAN_PX: [f64; 2] = [90.0, 470.0];
const INTERFACE_Y_PX: f64 = 196.0;
/// Fills of body 1 and body 2, and their outlines.
const FILLS: [&str; 2] = ["#e8e4d8", "#dbe4ec"];
const EDGE: &str = "#444";

/// The bodies seen along the frame's y.
pub(super) fn side_view_svg(scene: &Value, names: &UnitNames) -> String {
    let mut canvas = Canvas::default();
    let (left, right) = (BODY_SPAN_PX[0], BODY_SPAN_PX[1]);
    let lower = format!("M{left} {INTERFACE_Y_PX}H{right}V306H{left}Z");
    let upper = upper_body_outline(scene["gap"]["kind"].as_str().unwrap_or("flat"));
    for (i, (outline, key)) in [(lower, "body1"), (upper, "body2")].iter().enumerate() {
        let body = &scene[key];
        let infinite = body["kind"] == "half-space";
        let dash = if infinite { r#" stroke-dasharray="5 4""# } else { "" };
        canvas.add(format_args!(
            r#"<clipPath id="c{i}"><path d="{outline}"/></clipPath><path d="{outline}" fill="{}" stroke="{EDGE}"{dash}/>"#,
            FILLS[i]
        ));
        fibres(&mut canvas, &body["fibre"], i);
        supports(&mut canvas, body, i);
    }
    frame_line(&mut canvas, scene, names);
    canvas.text([12.0, 350.0], Anchor::Start, 12.0, &body_words(scene, "body1", names));
    canvas.text([12.0, 20.0], Anchor::Start, 12.0, &body_words(scene, "body2", names));
    draw_loads(&mut canvas, scene);
    canvas.into_svg(SIDE_VIEW_PX)
}

/// Outline of body 2 by the kind of the gap.
fn upper_body_outline(kind: &str) -> String {
    let (left, right) = (BODY_SPAN_PX[0], BODY_SPAN_PX[1]);
    let middle = 0.5 * (left + right);
    let top = 76.0;
    match kind {
        "flat" => format!("M{} {INTERFACE_Y_PX}V{top}H{}V{INTERFACE_Y_PX}Z", left + 70.0, right - 70.0),
        "cone" => format!("M{middle} {INTERFACE_Y_PX}L{left} 146V{top}H{right}V146Z"),
        "heights" => {
            let waves: Vec<String> = (0..=76)
                .map(|i| {
                    let s = f64::from(i) / 76.0;
                    let height = 12.0 + 6.0 * (23.0 * s).sin() + 5.0 * (61.0 * s + 1.0).sin();
                    format!("L{:.1} {:.1}", left + s * (right - left), INTERFACE_Y_PX - height)
                })
                .collect();
            format!("M{left} {top}{}V{top}Z", waves.concat())
        }
        _ => format!("M{left} 146Q{middle} {:.0} {right} 146V{top}H{left}Z", 2.0 * INTERFACE_Y_PX - 146.0),
    }
}

/// Lines along the fibres as they are seen from the side, in body `i`.
fn fibres(canvas: &mut Canvas, fibre: &Value, i: usize) {
    let Some(tilt) = fibre["tilt"].as_f64() else { return };
    let azimuth = fibre["azimuth"].as_f64().unwrap_or(0.0).to_radians();
    let (sin, cos) = tilt.to_radians().sin_cos();
    let seen = [cos * azimuth.cos(), sin];
    let length = seen[0].hypot(seen[1]);
    let y = if i == 0 { 252.0 } else { 116.0 };
    if length < 0.1 {
        for k in 0..12 {
            let x = BODY_SPAN_PX[0] + 20.0 + 31.0 * f64::from(k);
            canvas.add(format_args!(
                r##"<circle clip-path="url(#c{i})" cx="{x}" cy="{y}" r="3" fill="none" stroke="#998"/>"##
            ));
        }
        return;
    }
    let [dx, dy] = seen.map(|part| 300.0 * part / length);
    for k in -12..=24 {
        let x = BODY_SPAN_PX[0] + 31.0 * f64::from(k);
        let (x, y) = if dx.abs() < 60.0 { (x, y) } else { (280.0, y + 9.0 * f64::from(k - 6)) };
        canvas.add(format_args!(
            r##"<path clip-path="url(#c{i})" d="M{:.1} {:.1}L{:.1} {:.1}" stroke="#998" stroke-width="0.8"/>"##,
            x - dx, y + dy, x + dx, y - dy
        ));
    }
}

/// Hatched ground where a meshed body is held.
fn supports(canvas: &mut Canvas, body: &Value, i: usize) {
    if !body["fixed"].is_array() && !body["displaced"].is_array() {
        return;
    }
    let (y, way) = if i == 0 { (306.0, 9.0) } else { (76.0, -9.0) };
    canvas.add(format_args!(
        r#"<path d="M{} {y}H{}" stroke="{EDGE}" stroke-width="2"/>"#,
        BODY_SPAN_PX[0], BODY_SPAN_PX[1]
    ));
    for k in 0..38 {
        let x = BODY_SPAN_PX[0] + 10.0 * f64::from(k) + 8.0;
        canvas.add(format_args!(r#"<path d="M{x} {y}l-8 {way}" stroke="{EDGE}" stroke-width="0.8"/>"#));
    }
}

/// The frame between the bodies, with what it is.
fn frame_line(canvas: &mut Canvas, scene: &Value, names: &UnitNames) {
    let (from, to) = (BODY_SPAN_PX[0] + 60.0, BODY_SPAN_PX[1] - 60.0);
    canvas.add(format_args!(
        r#"<path d="M{from} {INTERFACE_Y_PX}H{to}M{from} 190v12M{to} 190v12" stroke="{}" stroke-width="3" fill="none"/>"#,
        SERIES_COLOURS[1]
    ));
    let frame = &scene["frame"];
    let cells = frame["cells"].as_array().filter(|cells| cells.len() == 2);
    let words = match (cells, frame["half_width"].as_array().filter(|half| half.len() == 2)) {
        (Some(cells), Some(half)) => {
            let side = |i: usize| format!("{}", 2.0 * half[i].as_f64().unwrap_or(0.0));
            format!(
                "contact frame {} × {} {}, {} × {} cells",
                side(0),
                side(1),
                names.length,
                cells[0],
                cells[1]
            )
        }
        _ => format!(
            "contact frame: {} of body {}",
            frame["points"].as_str().unwrap_or("cells"),
            frame["body"].as_u64().map_or("1 or 2".to_owned(), |b| b.to_string())
        ),
    };
    text_on_background(canvas, [280.0, 224.0], &words);
    let gap = &scene["gap"];
    let mut words = format!("gap: {}", gap["kind"].as_str().unwrap_or("not known"));
    for key in ["radius", "radii", "semi_axes", "slope", "exponent"] {
        if !gap[key].is_null() {
            words += &format!(", {} {}", key.replace('_', " "), with_unit(names, key, &gap[key]));
        }
    }
    text_on_background(canvas, [280.0, 100.0], &words);
}

/// Text on a light ground, so that it is read over lines.
fn text_on_background(canvas: &mut Canvas, at: [f64; 2], words: &str) {
    let width = 6.4 * words.chars().count() as f64 + 10.0;
    canvas.add(format_args!(
        r#"<rect x="{:.1}" y="{:.1}" width="{width:.1}" height="18" rx="3" fill="white" fill-opacity="0.88"/>"#,
        at[0] - 0.5 * width,
        at[1] - 13.0
    ));
    canvas.text(at, Anchor::Middle, 12.0, words);
}

fn body_words(scene: &Value, key: &str, names: &UnitNames) -> String {
    let body = &scene[key];
    let kind = match body["kind"].as_str() {
        Some("fe") => "finite elements",
        Some("be") => "boundary elements",
        Some("half-space") => "half-space",
        Some("rigid") => "rigid",
        _ => "not known",
    };
    let mut words = format!("body {}: {kind}", &key[4..]);
    if let Some(material) = body["material"].as_str() {
        words += &format!(", {material}");
    }
    let fibre = &body["fibre"];
    if !fibre["tilt"].is_null() {
        words += &format!(", fibres: tilt {}", with_unit(names, "tilt", &fibre["tilt"]));
        words += &format!(", azimuth {}", with_unit(names, "azimuth", &fibre["azimuth"]).replace('–', "0"));
    } else if fibre.is_object() {
        words += ", fibres that vary";
    }
    if body["layup"].is_object() {
        words += ", laminate";
    }
    let most = 84;
    if words.chars().count() > most {
        words.chars().take(most - 1).collect::<String>() + "…"
    } else {
        words
    }
}

/// Which loads some step has: along n, in the surface, to and fro, turning.
fn draw_loads(canvas: &mut Canvas, scene: &Value) {
    let any = |keys: &[&str]| {
        scene["steps"]
            .as_array()
            .into_iter()
            .flatten()
            .any(|step| keys.iter().any(|key| !step[key].is_null()))
    };
    let colour = SERIES_COLOURS[0];
    canvas.add(format_args!(
        r#"<defs><marker id="tip" viewBox="0 0 10 10" refX="8" refY="5" markerWidth="6" markerHeight="6" orient="auto-start-reverse"><path d="M0 0L10 5L0 10Z" fill="{colour}"/></marker></defs>"#
    ));
    let mut arrow = |d: &str, both: bool, at: [f64; 2], anchor: Anchor, words: &str| {
        let start = if both { r#" marker-start="url(#tip)""# } else { "" };
        canvas.add(format_args!(
            r#"<path d="{d}" stroke="{colour}" stroke-width="2.5" fill="none" marker-end="url(#tip)"{start}/>"#
        ));
        canvas.text(at, anchor, 12.0, words);
    };
    if any(&["approach", "normal_force"]) {
        arrow("M280 34V70", false, [290.0, 52.0], Anchor::Start, "approach or force");
    }
    if any(&["shift", "tangential_force"]) {
        arrow("M476 100H540", false, [550.0, 92.0], Anchor::End, "shift or force");
    }
    if any(&["cycles"]) {
        arrow("M480 130H540", true, [550.0, 148.0], Anchor::End, "cycles");
    }
    if any(&["sliding", "rolling"]) {
        arrow("M476 164H540", false, [550.0, 182.0], Anchor::End, "sliding, rolling");
    }
    if any(&["rotation", "moment", "twist", "spin_moment"]) {
        arrow("M30 150A34 34 0 0 1 82 104", false, [8.0, 92.0], Anchor::Start, "turning");
    }
    canvas.add(format_args!(
        r##"<path d="M22 306V270M22 306H58" stroke="#222" stroke-width="1.5" fill="none"/>"##
    ));
    canvas.text([62.0, 310.0], Anchor::Start, 12.0, "x");
    canvas.text([18.0, 262.0], Anchor::Start, 12.0, "n");
}

/// The frame seen from body 2, with directions of fibres and motions.
pub(super) fn top_view_svg(scene: &Value, names: &UnitNames) -> String {
    let mut canvas = Canvas::default();
    let frame = &scene["frame"];
    let pair = |value: &Value| {
        let list = value.as_array()?;
        Some([list.first()?.as_f64()?, list.get(1)?.as_f64()?])
    };
    let half = pair(&frame["half_width"]).filter(|half| half.iter().all(|side| *side > 0.0));
    let half = half.unwrap_or([1.0, 1.0]);
    let scale = 115.0 / half[0].max(half[1]);
    let middle = [200.0, 172.0];
    let turn = frame["azimuth"].as_f64().unwrap_or(0.0);
    let [w, h] = half.map(|side| side * scale);
    canvas.add(format_args!(r#"<g transform="translate({} {}) rotate({})">"#, middle[0], middle[1], -turn));
    let (fill, edge) = (FILLS[0], SERIES_COLOURS[1]);
    canvas.add(format_args!(
        r#"<rect x="{:.1}" y="{:.1}" width="{:.1}" height="{:.1}" fill="{fill}" stroke="{edge}" stroke-width="3"/>"#,
        -w, -h, 2.0 * w, 2.0 * h
    ));
    outline(&mut canvas, &frame["outline"], scale);
    canvas.add(format_args!("</g>"));
    let mut legend = Vec::new();
    for (i, key) in ["body1", "body2"].into_iter().enumerate() {
        let fibre = &scene[key]["fibre"];
        let tilt = fibre["tilt"].as_f64();
        if let Some(tilt) = tilt {
            let azimuth = fibre["azimuth"].as_f64().unwrap_or(0.0);
            let length = 90.0 * tilt.to_radians().cos();
            let colour = [SERIES_COLOURS[2], SERIES_COLOURS[3]][i];
            ray(&mut canvas, middle, azimuth, [-length, length], colour, "2.5");
            legend.push((colour, format!("fibres of body {}, projected", i + 1)));
        }
    }
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
            ray(&mut canvas, middle, turn + direction, [from, 60.0], SERIES_COLOURS[0], "4");
            legend.push((SERIES_COLOURS[0], format!("{name}: motion of body 2, or force")));
        }
    }
    for (i, (colour, words)) in legend.iter().enumerate() {
        let y = 306.0 + 14.0 * i as f64;
        canvas.add(format_args!(r#"<path d="M14 {:.1}h22" stroke="{colour}" stroke-width="3"/>"#, y - 4.0));
        canvas.text([42.0, y], Anchor::Start, 11.0, words);
    }
    canvas.text(
        [200.0, 18.0],
        Anchor::Middle,
        12.0,
        &format!(
            "frame from above, half sides {}",
            with_unit(names, "half_width", &frame["half_width"]).replace('–', "by its mesh")
        ),
    );
    canvas.add(format_args!(
        r##"<path d="M336 290H370M336 290V256" stroke="#222" stroke-width="1.5" fill="none"/>"##
    ));
    canvas.text([374.0, 294.0], Anchor::Start, 12.0, "x");
    canvas.text([332.0, 248.0], Anchor::Start, 12.0, "y");
    canvas.into_svg([TOP_VIEW_PX[0], TOP_VIEW_PX[1] + 14.0 * legend.len().saturating_sub(3) as f64])
}

/// A line through `middle` at `degrees`, between two distances.
fn ray(canvas: &mut Canvas, middle: [f64; 2], degrees: f64, ends: [f64; 2], colour: &str, width: &str) {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let at = |s: f64| format!("{:.1} {:.1}", middle[0] + s * cos, middle[1] - s * sin);
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

/// The outline of a punch, in the frame's axes.
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
