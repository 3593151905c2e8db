//! The photons of a pass, class by class.

use super::budget::PhotonBudget;
use super::content::Content;
use crate::graph::Graph;
use crate::kernels::deposits::Deposits;
use crate::kernels::maps::Maps;
use crate::kernels::photon::{self, Emission, Tracing};
use crate::kernels::scene_data::SceneBuffers;

/// Photons with their footprints; `None` if the budget has none.
pub fn photons(g: &mut Graph, content: Content<'_>, buffers: &SceneBuffers, budget: &PhotonBudget) -> Option<Deposits> {
    if budget.emissions.is_empty() {
        return None;
    }
    let mut store = Deposits::new(g, budget.capacity);
    trace_classes(g, (buffers, content), budget, photon::trace, &mut store);
    Some(store)
}

/// Light vertices of the same photons; `None` if the budget has none.
pub fn vertices(
    g: &mut Graph,
    content: Content<'_>,
    buffers: &SceneBuffers,
    budget: &PhotonBudget,
) -> Option<Deposits> {
    if budget.emissions.is_empty() {
        return None;
    }
    let mut store = Deposits::vertices(g, budget.capacity);
    trace_classes(g, (buffers, content), budget, photon::trace_vertices, &mut store);
    Some(store)
}

/// [`photon::trace`] or [`photon::trace_vertices`].
type Trace = fn(&mut Graph, &SceneBuffers, Tracing<'_>, Emission, &mut Deposits);

fn trace_classes(
    g: &mut Graph,
    (buffers, content): (&SceneBuffers, Content<'_>),
    budget: &PhotonBudget,
    trace: Trace,
    store: &mut Deposits,
) {
    let maps = content.device.maps.as_ref();
    let imported = maps.map(|maps| (maps.settings, g.import_read(&maps.centres), g.import_read(&maps.texels)));
    let maps = imported
        .as_ref()
        .map(|(settings, centres, texels)| (Maps { shape: settings.shape(), centres, texels }, settings.search()));
    let how = Tracing { variant: content.device.variant, maps };
    for emission in &budget.emissions {
        let name = if emission.caustic { "caustic photons" } else { "global photons" };
        g.scope(name, |g| trace(g, buffers, how, *emission, store));
    }
}
