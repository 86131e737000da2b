//! Runs that are images of each other: mirrored, turned by right angles, or the same.
//!
//! A scene has an image where it is known of each of its keys how a reflection or a turn changes it. Half-spaces are the same wherever they are, so that
//! the middle of the frame, where it is given, counts for nothing. Of the eight images of a scene the least, as text, is the same for all runs that are images of
//! each other.

use serde_json::{Map, Value, json};

use crate::geometry::GridSymmetry;
use crate::scene::plan::Plan;

type Table = Map<String, Value>;

/// Steps of 1 to which components of unit vectors are rounded, so that those which differ by rounding alone are the same.
const STEPS: f64 = 1e12;

/// A scene but for reflections and turns.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shape {
    /// The same of all scenes that are images of each other.
    pub text: String,
    /// What makes that image of the scene.
    pub symmetry: GridSymmetry,
}

impl Shape {
    /// That of a scene; `None` where not all that it has is known to have an image.
    pub(super) fn of(plan: &Plan) -> Option<Self> {
        if plan.accuracy.is_some() {
            return None;
        }
        let root = plan.document.root.to_serde_json();
        let scene = root.as_object()?;
        let mut least: Option<Self> = None;
        for symmetry in GridSymmetry::ALL {
            let text = Value::Object(Image { scene, symmetry }.of_scene()?).to_string();
            if least.as_ref().is_none_or(|least| text < least.text) {
                least = Some(Self { text, symmetry });
            }
        }
        let Self { text, symmetry } = least?;
        // What is the same of all images.
        let same = ["units", "materials", "solver"].map(|key| scene.get(key));
        Some(Self { text: json!([text, same]).to_string(), symmetry })
    }

    /// What makes this scene of `other`; `None` where they are not images of each other.
    pub fn from(&self, other: &Self) -> Option<GridSymmetry> {
        (self.text == other.text).then(|| self.symmetry.inverse().after(other.symmetry))
    }
}

/// Makes the image of a scene.
struct Image<'a> {
    scene: &'a Table,
    symmetry: GridSymmetry,
}

/// The keys `same` of a table as they are; `None` if it has others than these and those that are `moved`.
fn copied(table: &Table, same: &[&str], moved: &[&str]) -> Option<Table> {
    let known = |key: &String| same.contains(&key.as_str()) || moved.contains(&key.as_str());
    if !table.keys().all(known) {
        return None;
    }
    let copied = table.iter().filter(|(key, _)| same.contains(&key.as_str()));
    Some(copied.map(|(key, value)| (key.clone(), value.clone())).collect())
}

fn table(value: Option<&Value>) -> Option<&Table> {
    value?.as_object()
}

fn pair(value: &Value) -> Option<[f64; 2]> {
    let list = value.as_array()?;
    let [x, y] = list.as_slice() else { return None };
    Some([x.as_f64()?, y.as_f64()?])
}

/// An angle in degrees; 0 without the key.
fn angle(table: &Table, key: &str) -> Option<f64> {
    table.get(key).map_or(Some(0.0), Value::as_f64)
}

fn direction(degrees: f64) -> [f64; 2] {
    let (sin, cos) = degrees.to_radians().sin_cos();
    [cos, sin]
}

/// A unit vector, rounded.
fn rounded(components: &[f64]) -> Vec<i64> {
    components.iter().map(|component| (component * STEPS).round() as i64).collect()
}

/// A vector by its length and its direction.
fn vector([x, y]: [f64; 2]) -> Value {
    let length = x.hypot(y);
    let direction = if length > 0.0 { rounded(&[x / length, y / length]) } else { vec![0, 0] };
    json!([format!("{length:.11e}"), direction])
}

/// A direction without a sense.
fn line(components: &[f64]) -> Value {
    let mut line = rounded(components);
    if line.iter().find(|component| **component != 0).is_some_and(|first| *first < 0) {
        line.iter_mut().for_each(|component| *component = -*component);
    }
    json!(line)
}

/// A polygon, whichever of its vertices is the first and which way round they go.
fn polygon(mut vertices: Vec<Value>) -> Value {
    let mut texts: Vec<String> = vertices.iter().map(Value::to_string).collect();
    for reversed in [false, true] {
        if reversed {
            vertices.reverse();
        }
        for first in 0..vertices.len() {
            let turned = |k: usize| vertices[(first + k) % vertices.len()].to_string();
            let other: Vec<String> = (0..vertices.len()).map(turned).collect();
            texts = texts.min(other);
        }
    }
    json!(texts)
}

impl Image<'_> {
    fn of_scene(&self) -> Option<Table> {
        let keys = [
            "title",
            "units",
            "materials",
            "body1",
            "body2",
            "frame",
            "gap",
            "friction",
            "wear",
            "steps",
            "output",
            "solver",
            "compare",
        ];
        let mut image = copied(self.scene, &[], &keys)?;
        let mut put = |key: &str, value: Table| image.insert(key.to_owned(), Value::Object(value));
        for key in ["body1", "body2"] {
            put(key, self.body(table(self.scene.get(key))?)?);
        }
        put("frame", self.frame(table(self.scene.get("frame"))?)?);
        put("gap", self.gap(table(self.scene.get("gap"))?)?);
        if let Some(friction) = self.scene.get("friction") {
            let same = ["law", "mu", "mu1", "mu2", "mu_L", "mu_T", "mu_N", "body"];
            put("friction", self.law(friction.as_object()?, &same)?);
        }
        if let Some(wear) = self.scene.get("wear") {
            let same = [
                "law",
                "i",
                "i1",
                "i2",
                "i_L",
                "i_T",
                "i_N",
                "k",
                "body",
                "share",
                "integrator",
                "tolerance",
                "beyond_critical",
                "move_mesh",
            ];
            put("wear", self.law(wear.as_object()?, &same)?);
        }
        if let Some(output) = self.scene.get("output") {
            put("output", copied(output.as_object()?, &["fields", "checkpoint"], &[])?);
        }
        let steps = self.scene.get("steps")?.as_array()?;
        let steps = steps.iter().map(|step| self.step(step.as_object()?).map(Value::Object));
        image.insert("steps".to_owned(), Value::Array(steps.collect::<Option<_>>()?));
        Some(image)
    }

    /// The image of a vector in the surface.
    fn vector(&self, v: [f64; 2]) -> Value {
        vector(self.symmetry.apply(v))
    }

    /// The image of an axis in the surface, `degrees` from x.
    fn axis(&self, degrees: f64) -> Value {
        line(&self.symmetry.apply(direction(degrees)))
    }

    fn body(&self, body: &Table) -> Option<Table> {
        let mut image = copied(body, &["kind", "material"], &["fibre"])?;
        match body.get("kind")?.as_str()? {
            "rigid" => return Some(image),
            "half-space" => {}
            _ => return None,
        }
        let material = table(self.scene.get("materials"))?.get(body.get("material")?.as_str()?)?;
        let model = material.get("model")?.as_str()?;
        match (model, body.get("fibre")) {
            ("isotropic", None) => return Some(image),
            ("isotropic" | "transversely-isotropic" | "orthotropic", _) => {}
            // An axis of its own, which a reflection may turn round.
            _ => return None,
        }
        let none = Table::new();
        let fibre = body.get("fibre").map_or(Some(&none), Value::as_object)?;
        image.insert("fibre".to_owned(), self.fibre(fibre)?);
        if model == "orthotropic" {
            // Axis 2 lies in the surface, axis 3 follows.
            image.insert("axis 2".to_owned(), self.axis(angle(fibre, "azimuth")? + 90.0));
        }
        Some(image)
    }

    /// The image of a fibre, which has no sense.
    fn fibre(&self, fibre: &Table) -> Option<Value> {
        copied(fibre, &[], &["azimuth", "tilt"])?;
        let (sin, cos) = angle(fibre, "tilt")?.to_radians().sin_cos();
        let [x, y] = self.symmetry.apply(direction(angle(fibre, "azimuth")?));
        Some(line(&[cos * x, cos * y, sin]))
    }

    /// A law of friction or wear.
    fn law(&self, law: &Table, same: &[&str]) -> Option<Table> {
        let mut image = copied(law, same, &["angle", "fibre"])?;
        let has_axes = matches!(law.get("law")?.as_str()?, "elliptic" | "orthotropic");
        if has_axes || law.contains_key("angle") {
            image.insert("axis".to_owned(), self.axis(angle(law, "angle")?));
        }
        if let Some(fibre) = law.get("fibre") {
            image.insert("fibre".to_owned(), self.fibre(fibre.as_object()?)?);
        }
        Some(image)
    }

    fn frame(&self, frame: &Table) -> Option<Table> {
        let sides = ["cells", "half_width", "periodic"];
        let moved = ["azimuth", "center", "outline", sides[0], sides[1], sides[2]];
        let mut image = copied(frame, &["kind", "grow"], &moved)?;
        if frame.get("kind")?.as_str()? != "grid" || angle(frame, "azimuth")? != 0.0 {
            return None;
        }
        for key in sides {
            let Some(value) = frame.get(key) else { continue };
            let [x, y] = value.as_array()?.as_slice() else { return None };
            image.insert(key.to_owned(), json!(self.symmetry.swap_axes([x, y])));
        }
        if let Some(outline) = frame.get("outline") {
            image.insert("outline".to_owned(), Value::Object(self.outline(outline.as_object()?)?));
        }
        Some(image)
    }

    fn outline(&self, outline: &Table) -> Option<Table> {
        let moved = ["center", "angle", "vertices"];
        let mut image = copied(outline, &["shape", "radius", "semi_axes"], &moved)?;
        self.place(outline, "center", &mut image)?;
        if outline.get("shape")?.as_str()? == "ellipse" {
            image.insert("axis".to_owned(), self.axis(angle(outline, "angle")?));
        }
        if let Some(vertices) = outline.get("vertices") {
            let vertices = vertices.as_array()?.iter().map(|vertex| Some(self.vector(pair(vertex)?)));
            image.insert("vertices".to_owned(), polygon(vertices.collect::<Option<_>>()?));
        }
        Some(image)
    }

    fn gap(&self, gap: &Table) -> Option<Table> {
        let same = ["kind", "exact", "radius", "radii", "semi_axes", "slope", "coefficient", "exponent"];
        let mut image = copied(gap, &same, &["offset", "angle"])?;
        self.place(gap, "offset", &mut image)?;
        match gap.get("kind")?.as_str()? {
            "sphere" | "cone" | "flat" | "power" => {}
            "ellipsoid" | "cylinder" => {
                image.insert("axis".to_owned(), self.axis(angle(gap, "angle")?));
            }
            _ => return None,
        }
        Some(image)
    }

    /// The image of a place in the frame, [0, 0] without the key.
    fn place(&self, table: &Table, key: &str, image: &mut Table) -> Option<()> {
        let place = table.get(key).map_or(Some([0.0; 2]), pair)?;
        image.insert(key.to_owned(), self.vector(place));
        Some(())
    }

    fn step(&self, step: &Table) -> Option<Table> {
        let same = ["name", "approach", "normal_force", "increments", "friction", "wear"];
        let moved = [
            "shift",
            "tangential_force",
            "rotation",
            "moment",
            "twist",
            "spin_moment",
            "cycles",
            "sliding",
            "rolling",
        ];
        let mut image = copied(step, &same, &moved)?;
        let hand = self.symmetry.handedness();
        let mut put = |key: &str, value: Value| image.insert(key.to_owned(), value);
        for (key, value) in step.iter().filter(|(key, _)| moved.contains(&key.as_str())) {
            let value = match key.as_str() {
                "tangential_force" => self.vector(pair(value)?),
                "rotation" | "moment" => {
                    let [x, y] = pair(value)?;
                    let [x, y, _] = self.symmetry.apply_axial([x, y, 0.0]);
                    vector([x, y])
                }
                "twist" | "spin_moment" => json!(format!("{:.15e}", hand * value.as_f64()? + 0.0)),
                "shift" => {
                    let shift = value.as_object()?;
                    copied(shift, &[], &["distance", "angle"])?;
                    let distance = shift.get("distance")?.as_f64()?;
                    self.vector(direction(angle(shift, "angle")?).map(|component| distance * component))
                }
                "rolling" => Value::Object(self.rolling(value.as_object()?)?),
                // To and fro, or one way, along an angle.
                _ => Value::Object(self.motion(value.as_object()?)?),
            };
            put(key, value);
        }
        Some(image)
    }

    fn motion(&self, motion: &Table) -> Option<Table> {
        // Round an ellipse a reflection goes the other way.
        if motion.get("path").is_some_and(|path| path != "line") {
            return None;
        }
        let same = ["amplitude", "force_amplitude", "count", "increments", "jumps", "distance", "path"];
        let mut image = copied(motion, &same, &["angle"])?;
        image.insert("along".to_owned(), self.vector(direction(angle(motion, "angle")?)));
        Some(image)
    }

    fn rolling(&self, rolling: &Table) -> Option<Table> {
        let mut image = copied(rolling, &["distance"], &["direction", "creepage", "spin"])?;
        let hand = self.symmetry.handedness();
        let [along, left] = rolling.get("creepage").map_or(Some([0.0; 2]), pair)?;
        let spin = angle(rolling, "spin")?;
        image.insert("along".to_owned(), self.vector(direction(angle(rolling, "direction")?)));
        let creepage = [along, hand * left, hand * spin].map(|part| format!("{:.15e}", part + 0.0));
        image.insert("creepage".to_owned(), json!(creepage));
        Some(image)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene;

    const SCENE: &str = r#"
[materials.steel]
model = "isotropic"
E = 210e3
nu = 0.3
[materials.wood]
model = "orthotropic"
E1 = 12e3
E2 = 1.1e3
E3 = 0.6e3
nu12 = 0.4
nu13 = 0.4
nu23 = 0.45
G12 = 0.9e3
G13 = 0.7e3
G23 = 0.06e3
[materials.cfrp]
model = "transversely-isotropic"
E1 = 139e3
E2 = 8.7e3
nu12 = 0.32
nu23 = 0.369
G12 = 4.5e3
[body1]
kind = "half-space"
material = "cfrp"
fibre = { azimuth = 0.0, tilt = 30.0 }
[body2]
kind = "half-space"
material = "steel"
[frame]
kind = "grid"
half_width = [1.0, 1.0]
cells = [8, 8]
[gap]
kind = "sphere"
radius = 50.0
[friction]
law = "coulomb"
mu = 0.4
[[steps]]
name = "indent"
approach = 0.01
[[steps]]
name = "shift"
shift = { distance = 0.004, angle = 20.0 }
"#;

    fn shape(changes: &[(&str, &str)]) -> Option<Shape> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("scene.toml");
        let changed = changes.iter().fold(SCENE.to_owned(), |text, (from, to)| {
            assert!(text.contains(from), "{from}");
            text.replacen(from, to, 1)
        });
        std::fs::write(&path, changed).expect("a file");
        let plan = scene::read(&path, &[]).unwrap_or_else(|mistakes| panic!("{mistakes:?}"));
        Shape::of(&plan)
    }

    /// Truth: the group of the fibre's plane: y to -y leaves a fibre in the plane of x and n where it is; x to -x turns a tilted one round, not one in the
    /// surface; of one along the normal, and of none, all that maps the grid onto itself is an image.
    #[test]
    fn images_of_fibres() {
        let angle = |degrees: &'static str| ("angle = 20.0", degrees);
        let images = |fibre: (&'static str, &'static str)| {
            let first = shape(&[fibre]).expect("a scene with images");
            ["angle = -20.0", "angle = 160.0", "angle = 200.0", "angle = 70.0", "angle = 30.0"].map(
                |degrees| {
                    let other = shape(&[fibre, angle(degrees)]).expect("a scene with images");
                    other.from(&first).is_some()
                },
            )
        };
        let tilt = "tilt = 30.0";
        assert_eq!(images((tilt, tilt)), [true, false, false, false, false]);
        assert_eq!(images((tilt, "tilt = 0.0")), [true, true, true, false, false]);
        assert_eq!(images((tilt, "tilt = 90.0")), [true, true, true, true, false]);
        assert_eq!(
            images(("material = \"cfrp\"\nfibre", "material = \"steel\"\nfibre")),
            [true, false, false, false, false]
        );
        // Axis 2 of an orthotropic body lies in the surface.
        let wood = "material = \"wood\"\nfibre = { azimuth = 0.0, tilt = 90.0 }";
        let cfrp = "material = \"cfrp\"\nfibre = { azimuth = 0.0, tilt = 30.0 }";
        assert_eq!(images((cfrp, wood)), [true, true, true, false, false]);
    }

    /// Truth: a change of one thing that has no symmetry, of two runs that are images else.
    #[test]
    fn what_is_no_image() {
        let mirrored = [("azimuth = 0.0", "azimuth = 10.0"), ("angle = 20.0", "angle = -20.0")];
        let first = shape(&[("azimuth = 0.0", "azimuth = -10.0")]).expect("a scene with images");
        let is_image = |more: (&str, &str)| {
            let other = shape(&[&mirrored[..], &[more]].concat());
            other.is_some_and(|other| other.from(&first).is_some())
        };
        assert!(is_image(("mu = 0.4", "mu = 0.4")));
        assert!(is_image(("cells = [8, 8]", "cells = [8, 8]\ncenter = [0.1, 0.2]")));
        for change in [
            ("mu = 0.4", "mu = 0.41"),
            ("azimuth = 10.0", "azimuth = 10.1"),
            ("tilt = 30.0", "tilt = -30.0"),
            ("nu = 0.3", "nu = 0.31"),
            ("radius = 50.0", "radius = 50.0\noffset = [0.0, 0.1]"),
            ("cells = [8, 8]", "cells = [8, 9]"),
            ("cells = [8, 8]", "cells = [8, 8]\nazimuth = 5.0"),
            ("approach = 0.01", "approach = 0.01\ntwist = 0.1"),
            ("approach = 0.01", "approach = 0.01\nrotation = [0.1, 0.0]"),
            ("approach = 0.01", "approach = 0.01\nincrements = 2"),
            ("distance = 0.004", "distance = -0.004"),
        ] {
            assert!(!is_image(change), "{change:?}");
        }
    }

    /// Truth: a polygon is its vertices, whichever is named first and in either sense.
    #[test]
    fn images_of_polygons() {
        let with = |vertices: &str, angle: &str| {
            let outline =
                format!("cells = [8, 8]\n[frame.outline]\nshape = \"polygon\"\nvertices = {vertices}");
            shape(&[("cells = [8, 8]", outline.as_str()), ("angle = 20.0", angle)])
                .expect("a scene with images")
        };
        let first = with("[[-0.5, -0.4], [0.5, -0.4], [0.5, 0.4], [-0.5, 0.4]]", "angle = 20.0");
        for (vertices, is_image) in [
            ("[[-0.5, -0.4], [0.5, -0.4], [0.5, 0.4], [-0.5, 0.4]]", true),
            ("[[0.5, 0.4], [0.5, -0.4], [-0.5, -0.4], [-0.5, 0.4]]", true),
            ("[[-0.5, -0.4], [0.5, -0.4], [0.5, 0.41], [-0.5, 0.4]]", false),
        ] {
            assert_eq!(with(vertices, "angle = -20.0").from(&first).is_some(), is_image, "{vertices}");
        }
    }

    /// Truth: the documentation: what is not known to have an image has none.
    #[test]
    fn scenes_without_images() {
        assert!(shape(&[]).is_some());
        for change in [
            ("[materials.steel]", "accuracy = 0.01\n[materials.steel]"),
            (
                "[gap]",
                "[[output.inside]]\nname = \"a\"\nbody = 1\nfrom = [0, 0, -1]\nto = [0, 0, -2]\npoints = 3\n[gap]",
            ),
            (
                "shift = { distance = 0.004, angle = 20.0 }",
                "cycles = { amplitude = 0.001, amplitude2 = 0.0005, path = \"ellipse\", count = 10, jumps = 1 }",
            ),
            ("material = \"steel\"", "material = \"steel\"\ntruncated = 5.0"),
        ] {
            assert!(shape(&[change]).is_none(), "{change:?}");
        }
    }
}
