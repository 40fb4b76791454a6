//! Plans and statistics as JSON, the same for the command line and the service.

use crate::pass1_light::{Energy, Source, Tally};
use crate::plan::{Plan, source_name};
use crate::render::{PassTime, Render};
use crate::scene::Scene;
use glam::DVec3;
use serde_json::{Value, json};

/// The plan: decisions with their reasons, warnings, windows and memory.
#[must_use]
pub fn plan_json(scene: &Scene, plan: &Plan) -> Value {
    let decisions: Vec<Value> = plan
        .decisions
        .iter()
        .map(|d| json!({ "topic": d.topic, "runs": d.runs, "choice": d.choice, "reason": d.reason }))
        .collect();
    let warnings: Vec<Value> = plan
        .warnings
        .iter()
        .map(|w| json!({ "code": w.code, "pointer": w.pointer, "message": w.message }))
        .collect();
    let windows: Vec<Value> = plan
        .photons
        .iter()
        .map(|budget| {
            json!({
                "light": source_name(scene, budget.window.source),
                "caster": budget.window.caster.map(|caster| &scene.objects[caster.index()].name),
                "photons_per_round": 2_u64 << budget.log2_block,
                "carries": budget.carries.as_str(),
            })
        })
        .collect();
    json!({
        "decisions": decisions,
        "warnings": warnings,
        "windows": windows,
        "memory_bytes": plan.memory_bytes,
    })
}

/// What a render did: stop reason, error, time, photons per light, rays.
#[must_use]
pub fn stats_json(render: &Render) -> Value {
    let stats = render.stats();
    let time = |t: PassTime| json!({ "wall": t.wall, "cpu": t.cpu });
    let mut total = Tally::default();
    stats.windows.iter().for_each(|tally| total.add(tally));
    json!({
        "version": env!("CARGO_PKG_VERSION"),
        "scene": render.scene().name,
        "image": [render.scene().image.width, render.scene().image.height],
        "rounds": stats.rounds,
        "stop_reason": stats.stop_reason.map(|r| r.as_str()),
        "error_estimate": stats.error,
        "seconds": { "pass1": time(stats.pass1), "pass2": time(stats.pass2) },
        "photons": photons_json(&total, 2 * u64::from(stats.rounds)),
        "lights": lights_json(render, &stats.windows, 2 * u64::from(stats.rounds)),
        "eye": {
            "rays": stats.eye.eye_rays,
            "shadow_rays": stats.eye.shadow_rays,
            "photon_lookups": stats.eye.lookups,
            "short_lookups": stats.eye.short_lookups,
            "cut": stats.eye.cut,
            "paths": stats.eye.paths,
            "path_rays": stats.eye.path_rays,
            "drawn": {
                "lens_points": stats.eye.lens_points,
                "moments": stats.eye.moments,
                "wavelengths": stats.eye.wavelengths,
            },
        },
        "kernel_radius_pixels": render.plan().radius.pixels(stats.rounds.saturating_sub(1)),
        "plan": plan_json(render.scene(), render.plan()),
    })
}

/// Tallies per light, over all its windows.
fn lights_json(render: &Render, windows: &[Tally], blocks: u64) -> Vec<Value> {
    let mut lights: Vec<(Source, Tally)> = Vec::new();
    for (budget, tally) in render.plan().photons.iter().zip(windows) {
        match lights.iter_mut().find(|(source, _)| *source == budget.window.source) {
            Some((_, sum)) => sum.add(tally),
            None => lights.push((budget.window.source, *tally)),
        }
    }
    lights
        .iter()
        .map(|(source, tally)| {
            let mut value = photons_json(tally, blocks);
            value["light"] = source_name(render.scene(), *source).into();
            value
        })
        .collect()
}

/// Counts over the whole render; power as the mean over the `blocks` estimates of it.
fn photons_json(tally: &Tally, blocks: u64) -> Value {
    json!({
        "emitted": tally.sent,
        "hit_specular": tally.hit_caster,
        "stored": tally.stored,
        "escaped": tally.escaped,
        "cut": tally.cut,
        "rays": tally.rays,
        "power": energy_json(&tally.energy, blocks),
    })
}

fn energy_json(energy: &Energy, blocks: u64) -> Value {
    let mean = |power: DVec3| (power / blocks.max(1) as f64).to_array();
    json!({
        "emitted": mean(energy.emitted),
        "stored": mean(energy.stored),
        "absorbed": mean(energy.absorbed),
        "escaped": mean(energy.escaped),
        "cut": mean(energy.cut),
        "missed": mean(energy.missed),
    })
}
