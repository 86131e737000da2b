//! Uniform deformation of a half-space, by a uniform stress parallel to its surface or by a uniform thermal strain.

use nalgebra::{Matrix2, Matrix3, Matrix6, Vector2, Vector6};

use super::{BodyLoad, LoadCase, PointState};
use crate::error::{Error, Result};
use crate::frame::{ContactFrame, Side};
use crate::geometry::{Point, Triad, format_short};
use crate::material::{Stiffness, strain_of_gradient, tensor_to_voigt};

/// Strain along a period up to which the period counts as unstrained, divided by the largest strain. The tolerance
/// allows for rounded stresses in the input.
const PERIODIC_STRAIN_TOLERANCE: f64 = 1e-6;

const PERIOD_NAMES: [&str; 2] = ["x", "y"];

/// Largest distance between the unit normals of the frame and of its cells.
const NORMAL_TOLERANCE: f64 = 1e-6;

/// Uniform deformation of a half-space by the stress σ_xx, σ_yy, σ_xy or by a thermal strain. The surface stays plane
/// and does not rotate about its normal:
///
/// ```text
/// u_x = ε_xx x + ½γ_xy y + γ_xz z,   u_y = ½γ_xy x + ε_yy y + γ_yz z,   u_z = ε_zz z
/// ```
///
/// with z = 0 on the surface. The strain is ε = S σ with the compliance S, or the thermal strain.
pub(super) struct UniformDeformation {
    origin: Point,
    /// Displacement gradient at amplitude 1, global axes.
    gradient: Matrix3<f64>,
    /// Stress at amplitude 1, global axes, MPa.
    stress: Matrix3<f64>,
}

impl UniformDeformation {
    /// Deformation by a stress. `value` contains σ_xx, σ_yy, σ_xy in the axes of the frame, MPa. `stiffness` is the
    /// stiffness of the body in `axes`, whose third axis is the normal of the surface.
    ///
    /// # Errors
    /// If the normals of the frame and of its cells differ, or the surface would be strained along a period of the frame.
    pub fn new(value: [f64; 3], stiffness: &Stiffness, axes: &Triad, frame: &ContactFrame) -> Result<Self> {
        let [xx, yy, xy] = value;
        let turn = axes.0.transpose() * frame.axes.0;
        if (turn.column(2) - Point::z()).norm() > NORMAL_TOLERANCE {
            let normal = axes.normal();
            return Err(Error::input(format!(
                "a bulk stress is given in the axes of the frame, but the frame's normal is not that of the surface: set frame.normal = [{}, {}, {}]",
                normal.x, normal.y, normal.z
            )));
        }
        let stress = turn * Matrix3::new(xx, xy, 0.0, xy, yy, 0.0, 0.0, 0.0, 0.0) * turn.transpose();
        let strain = stiffness.compliance() * Vector6::from(tensor_to_voigt(&stress));
        let gradient = gradient_without_spin(&strain);
        if let Some(grid) = frame.grid {
            let in_plane = in_plane_strain(&gradient, &turn);
            if let Some(along) = strained_period(in_plane, grid.periodic) {
                let compliance = stiffness.rotated(&turn.transpose()).compliance();
                return Err(periodic_strain_error(value, in_plane, along, &compliance, grid.periodic));
            }
        }
        let to_global = |local: &Matrix3<f64>| axes.0 * local * axes.0.transpose();
        Ok(Self { origin: frame.origin, gradient: to_global(&gradient), stress: to_global(&stress) })
    }

    /// Deformation by the thermal strain `strain`, a tensor in global axes. The third of `axes` is the normal of the
    /// surface.
    ///
    /// # Errors
    /// If the surface would be strained along a period of the frame.
    pub fn of_thermal_strain(strain: &Matrix3<f64>, axes: &Triad, frame: &ContactFrame) -> Result<Self> {
        let gradient = gradient_without_spin(&strain_of_gradient(&(axes.0.transpose() * strain * axes.0)));
        let in_plane = in_plane_strain(&gradient, &(axes.0.transpose() * frame.axes.0));
        let strained = frame.grid.and_then(|grid| strained_period(in_plane, grid.periodic));
        if let Some(along) = strained {
            return Err(Error::input(format!(
                "the change of temperature strains the surface along the periodic direction {}: make the frame non-periodic along this direction, or replace the temperature by a bulk stress that strains the surface only perpendicular to it",
                PERIOD_NAMES[along]
            )));
        }
        let gradient = axes.0 * gradient * axes.0.transpose();
        Ok(Self { origin: frame.origin, gradient, stress: Matrix3::zeros() })
    }

    /// Load that causes this deformation of the body on `side` of `frame`, with the change of the gap at amplitude 1.
    ///
    /// # Errors
    /// If the surface moves across a plane of symmetry.
    pub fn load(&self, case: LoadCase, side: Side, frame: &ContactFrame) -> Result<BodyLoad> {
        let n = frame.n_cells();
        let mut gap = vec![0.0; 3 * n];
        for (i, (center, triad)) in frame.centers.iter().zip(frame.triads.iter()).enumerate() {
            let local = triad.to_local(&(self.displacement(center) * side.gap_sign()));
            // The normal gap does not change, because the surface stays plane.
            (gap[i], gap[n + i]) = (local.x, local.y);
        }
        let largest = gap.iter().fold(0.0, |largest: f64, gap| largest.max(gap.abs()));
        for (cell, projector) in frame.symmetry_projectors() {
            let local = Point::new(gap[cell], gap[n + cell], 0.0);
            if (projector * local - local).norm() > PERIODIC_STRAIN_TOLERANCE * largest {
                return Err(Error::input(
                    "this load moves the surface across a plane of symmetry: shear in the axes of this plane must vanish, and the centre of the frame must lie in the plane",
                ));
            }
        }
        Ok(BodyLoad { side: Some(side), case, gap })
    }

    fn displacement(&self, point: &Point) -> Point {
        self.gradient * (point - self.origin)
    }

    pub fn state(&self, amplitude: f64, point: &Point) -> PointState {
        PointState { displacement: amplitude * self.displacement(point), stress: amplitude * self.stress }
    }
}

/// Displacement gradient of a strain (Voigt order, third axis normal to the surface). The surface does not rotate.
fn gradient_without_spin(strain: &Vector6<f64>) -> Matrix3<f64> {
    let [x, y, z, yz, xz, xy]: [f64; 6] = (*strain).into();
    Matrix3::new(x, 0.5 * xy, xz, 0.5 * xy, y, yz, 0.0, 0.0, z)
}

/// Strains ε_xx, ε_yy, γ_xy of the surface in the axes of the frame. The columns of `turn` are these axes.
fn in_plane_strain(gradient: &Matrix3<f64>, turn: &Matrix3<f64>) -> [f64; 3] {
    let of_frame = turn.transpose() * gradient * turn;
    [of_frame[(0, 0)], of_frame[(1, 1)], 2.0 * of_frame[(0, 1)]]
}

/// First periodic direction (0 for x, 1 for y) along which the surface strains ε_xx, ε_yy, γ_xy do not vanish.
fn strained_period(strain: [f64; 3], periodic: [bool; 2]) -> Option<usize> {
    let [xx, yy, xy] = strain.map(f64::abs);
    let limit = PERIODIC_STRAIN_TOLERANCE * xx.max(yy).max(xy);
    let strained = [xx, yy].map(|along| along > limit || xy > limit);
    (0..2).find(|&axis| periodic[axis] && strained[axis])
}

/// Error message for the bulk stress `value`, which strains the surface along the periodic direction `along`.
fn periodic_strain_error(
    value: [f64; 3],
    strain: [f64; 3],
    along: usize,
    compliance: &Matrix6<f64>,
    periodic: [bool; 2],
) -> Error {
    if periodic == [true; 2] {
        return Error::input(
            "on a frame that is periodic along x and y, a bulk stress would change the length of a period: make the frame non-periodic along the direction of the stress",
        );
    }
    // Stresses for which the normal strain along the period and the shear strain vanish, at the given stress across the
    // period.
    const PLACES: [usize; 3] = [0, 1, 5];
    let given = 1 - along;
    let entry = |row: usize, column: usize| compliance[(PLACES[row], PLACES[column])];
    let matrix = Matrix2::new(entry(along, along), entry(along, 2), entry(2, along), entry(2, 2));
    let right = -Vector2::new(entry(along, given), entry(2, given)) * value[given];
    let found = matrix.lu().solve(&right).unwrap_or_default();
    let mut instead = value;
    (instead[along], instead[2]) = (found.x, found.y);
    // Rounds to ten digits and replaces -0 by 0.
    let rounded = |stress: f64| format!("{stress:.9e}").parse().unwrap_or(stress) + 0.0;
    Error::input(format!(
        "the bulk stress strains the surface by {} along the periodic direction {}, and by {} in shear; both must vanish, as with the stress [{}]",
        format_short(strain[along]),
        PERIOD_NAMES[along],
        format_short(strain[2]),
        instead.map(|stress| rounded(stress).to_string()).join(", ")
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::fibre_axes;
    use crate::material::Orthotropic;

    fn im7(tilt: f64, azimuth: f64) -> Stiffness {
        let constants = Orthotropic {
            e1: 167230.0,
            e2: 9544.0,
            e3: 9544.0,
            g12: 5292.0,
            g13: 5292.0,
            g23: 3483.0,
            nu12: 0.272,
            nu13: 0.272,
            nu23: 0.369,
        };
        Stiffness::orthotropic(&constants)
            .unwrap()
            .rotated(&fibre_axes(tilt.to_radians(), azimuth.to_radians()))
    }

    fn plane_strains(stiffness: &Stiffness, value: [f64; 3], frame: &ContactFrame) -> [f64; 6] {
        let bulk = UniformDeformation::new(value, stiffness, &frame.axes, frame).unwrap();
        let strain = strain_of_gradient(&bulk.gradient);
        assert!((stiffness.stress(&bulk.gradient) - bulk.stress).norm() < 1e-9);
        strain.into()
    }

    /// Truth: strains of IM7 carbon fibre by a compliance that an independent program computed. The tilts are 0, 30 and
    /// 90 degrees, and 30 degrees with azimuth 40 degrees.
    #[test]
    fn strains_of_tilted_fibres() {
        let frame = ContactFrame::grid([1.0, 1.0], [2, 2], [0.0, 0.0], 0.0).unwrap();
        for (tilt, azimuth, value, wanted) in [
            (0.0, 0.0, [100.0, 0.0, 0.0], [5.979788e-4, -1.626502e-4, 0.0]),
            (30.0, 0.0, [100.0, 0.0, 0.0], [4.473315e-3, -1.088564e-3, 0.0]),
            (90.0, 0.0, [100.0, 0.0, 0.0], [1.047779e-2, -3.866303e-3, 0.0]),
            (30.0, 40.0, [100.0, 0.0, 0.0], [7.977849e-3, -2.112194e-3, -3.317613e-3]),
            (30.0, 40.0, [0.0, 0.0, 100.0], [-3.317613e-3, -2.595638e-3, 1.725553e-2]),
        ] {
            let [x, y, _, _, _, xy] = plane_strains(&im7(tilt, azimuth), value, &frame);
            for (found, wanted) in [x, y, xy].into_iter().zip(wanted) {
                assert!((found - wanted).abs() < 1e-8, "{tilt}, {azimuth}: {found} {wanted}");
            }
        }
    }

    /// Truth: stress parallel to the frame would act as a traction on a surface that is inclined to the frame. The
    /// stress is therefore refused.
    #[test]
    fn inclined_surfaces_are_refused() {
        let mut frame = ContactFrame::grid([1.0, 1.0], [2, 2], [0.0, 0.0], 0.0).unwrap();
        let surface = frame.axes;
        frame.axes = Triad(*nalgebra::Rotation3::from_axis_angle(&Point::y_axis(), 0.2).matrix());
        let steel = Stiffness::isotropic(210e3, 0.3).unwrap();
        let message =
            UniformDeformation::new([100.0, 0.0, 0.0], &steel, &surface, &frame).err().unwrap().to_string();
        assert!(message.contains("set frame.normal = [0, 0, 1]"), "{message}");
    }

    /// Truth: plane strain (ε_yy = 0) of an isotropic body needs σ_yy = ν σ_xx. The message proposes this stress, and
    /// the program accepts it.
    #[test]
    fn periods_are_not_strained() {
        let mut frame = ContactFrame::grid([1.0, 1.0], [2, 2], [0.0, 0.0], 0.0).unwrap();
        frame.grid.as_mut().unwrap().periodic = [false, true];
        let steel = Stiffness::isotropic(210e3, 0.3).unwrap();
        let bulk = |value| UniformDeformation::new(value, &steel, &frame.axes, &frame).map(|_| ());
        let message = bulk([100.0, 0.0, 0.0]).unwrap_err().to_string();
        assert!(message.contains("[100, 30, 0]"), "{message}");
        bulk([100.0, 30.0, 0.0]).unwrap();
    }
}
