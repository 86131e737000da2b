//! Message about increments without contact.

use crate::error::warning;
use crate::evolution::controls::ActiveControls;
use crate::evolution::given_warnings::StepWarning;
use crate::evolution::model::PreparedModel;
use crate::evolution::records::IncrementRecord;
use crate::evolution::step::{Normal, Tilt};

impl PreparedModel<'_> {
    /// Warning that no cell is in contact. `left` is the smallest gap, in the length unit of the scene.
    ///
    /// `None` under zero force, because no contact is then the correct solution. A cell comes into contact when its
    /// mean gap closes, so the model may miss smaller overlaps of the surfaces.
    pub(super) fn no_contact_message(
        &self,
        record: &IncrementRecord,
        held: &ActiveControls,
        left: f64,
    ) -> Option<(StepWarning, String)> {
        if held.normal == Normal::Force(0.0) {
            return None;
        }
        let place = format!("step \"{}\" ({})", record.name, record.increment);
        if record.approach <= 0.0 || record.max_wear_depth > 0.0 {
            let note = format!(
                "{place}: the bodies are not in contact, so that all contact forces are 0. If contact is intended, check approach, gap and frame"
            );
            return Some((StepWarning::NoContact, note));
        }
        if matches!(held.tilt, Tilt::Moment(_)) && record.rotation != [0.0; 2] {
            let note = warning(&format!(
                "{place}: no cell is in contact, although body 2 was moved {:.4e} past the first touch: the moment rotates body 2 by {:.4e} degrees, out of contact. Pressures balance a moment only if the contact lies around frame.center: set frame.center to the middle of the contact, change the moment, or prescribe `rotation`",
                record.approach,
                record.rotation[0].hypot(record.rotation[1])
            ));
            return Some((StepWarning::NoContactPastFirstTouch, note));
        }
        let frame = &self.model.frame;
        let side = frame.mean_cell_side();
        let note = warning(&format!(
            "{place}: none of the {} cells is in contact, although body 2 was moved {:.4e} past the first touch; the smallest gap is {left:.4e}. If the cells (side {side:.3e}) are too coarse, use smaller ones or an approach above {:.4e}. Otherwise check frame.center, gap.offset and the meshes",
            frame.n_cells(),
            record.approach,
            record.approach + left
        ));
        Some((StepWarning::NoContactPastFirstTouch, note))
    }
}
