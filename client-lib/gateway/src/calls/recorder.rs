//! CARLA's recorder.

use super::Call;
use crate::args::Refusal;

pub(super) fn refuse(_: &mut Call) -> Result<(), Refusal> {
    Err("this simulator does not record yet; `omnibus collect` writes data sets".into())
}
