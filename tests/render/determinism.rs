//! The same scene, seed and rounds give the same bytes, on any number of threads and after a resume.

use crate::support::{camera_above, compile, floor, scene};
use nephroid::plan::Plan;
use nephroid::render::{CheckpointError, Control, Render, RenderError};
use serde_json::{Value, json};
use std::sync::Arc;

/// Glass, mirror, an area light and an environment: every random decision there is.
fn value() -> Value {
    let objects = json!([
        floor(2.0, 0.0),
        { "type": "sphere", "material": "glass", "center": [0, 0.6, 0], "radius": 0.5 },
        { "type": "sphere", "material": "mirror", "center": [0.9, 0.5, 0.3], "radius": 0.3 },
    ]);
    let lights = json!([{ "type": "quad", "center": [0, 3, 1], "size": [0.4, 0.3], "towards": [0, 0, 0],
                          "radiance": [20, 18, 15] }]);
    let mut value = scene(camera_above([0.3, 0.0, 0.0], 3.0, 2.0), objects, lights);
    value["image"] = json!({ "width": 50, "height": 37 });
    value["environment"] = json!({ "radiance": [0.1, 0.2, 0.3] });
    value
}

fn new_render() -> Render {
    let scene = compile(&value());
    let plan = Plan::new(&scene);
    Render::new(Arc::new(scene), plan)
}

fn in_pool<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
}

fn bits(render: &Render) -> Vec<[u32; 3]> {
    render.image().pixels.iter().map(|p| p.map(f32::to_bits)).collect()
}

#[test]
fn the_picture_does_not_depend_on_the_number_of_threads() {
    let pictures: Vec<_> = [1, 2, 7]
        .into_iter()
        .map(|threads| {
            in_pool(threads, || {
                let mut render = new_render();
                for _ in 0..3 {
                    render.run_round(&Control::new()).unwrap();
                }
                bits(&render)
            })
        })
        .collect();
    assert!(pictures[0].iter().any(|p| *p != [0; 3]));
    assert!(pictures[0] == pictures[1] && pictures[0] == pictures[2]);
}

#[test]
fn a_resumed_render_gives_the_same_bytes_as_an_undisturbed_one() {
    let mut undisturbed = new_render();
    for _ in 0..4 {
        undisturbed.run_round(&Control::new()).unwrap();
    }
    let mut first = new_render();
    first.run_round(&Control::new()).unwrap();
    first.run_round(&Control::new()).unwrap();
    let checkpoint = first.checkpoint();
    let scene = compile(&value());
    let plan = Plan::new(&scene);
    let mut resumed = Render::resume(Arc::new(scene), plan, &checkpoint).unwrap();
    assert_eq!(resumed.rounds(), 2);
    resumed.run_round(&Control::new()).unwrap();
    resumed.run_round(&Control::new()).unwrap();
    assert!(bits(&resumed) == bits(&undisturbed));
    assert_eq!(resumed.stats().windows, undisturbed.stats().windows);
}

/// Paths are counted apart, and the first round's are few: also a checkpoint in the middle of it goes on as it would have.
#[test]
fn a_complete_render_goes_on_from_any_checkpoint() {
    let mut value = value();
    value["render"]["paths"] = serde_json::json!("complete");
    let render = || {
        let scene = compile(&value);
        let plan = Plan::new(&scene);
        Render::new(Arc::new(scene), plan)
    };
    let mut undisturbed = render();
    (0..3).for_each(|_| _ = undisturbed.run_round(&Control::new()).unwrap());
    for rounds in 0..3 {
        let mut first = render();
        (0..rounds).for_each(|_| _ = first.run_round(&Control::new()).unwrap());
        let cancelled = Control::new();
        cancelled.cancel();
        assert!(first.run_round(&cancelled).is_err());
        let scene = compile(&value);
        let plan = Plan::new(&scene);
        let mut resumed = Render::resume(Arc::new(scene), plan, &first.checkpoint()).unwrap();
        (rounds..3).for_each(|_| _ = resumed.run_round(&Control::new()).unwrap());
        assert!(bits(&resumed) == bits(&undisturbed), "{rounds}");
    }
}

/// A crash between the last round and its picture: the picture is made of the checkpoint alone.
#[test]
fn a_picture_of_a_checkpoint_is_the_picture_without_one() {
    for rounds in 1..=5 {
        let mut render = new_render();
        for _ in 0..rounds {
            render.run_round(&Control::new()).unwrap();
        }
        let scene = compile(&value());
        let plan = Plan::new(&scene);
        let resumed = Render::resume(Arc::new(scene), plan, &render.checkpoint()).unwrap();
        assert!(bits(&resumed) == bits(&render), "{rounds} rounds");
        assert_eq!(resumed.error_estimate(), render.error_estimate());
    }
}

#[test]
fn a_checkpoint_that_does_not_fit_is_refused() {
    let mut render = new_render();
    render.run_round(&Control::new()).unwrap();
    let checkpoint = render.checkpoint();
    let resume = |bytes: &[u8]| {
        let scene = compile(&value());
        let plan = Plan::new(&scene);
        Render::resume(Arc::new(scene), plan, bytes).err()
    };
    assert_eq!(resume(b"what"), Some(CheckpointError::Unknown));
    assert_eq!(resume(&checkpoint[..checkpoint.len() - 1]), Some(CheckpointError::Mismatch));
    assert_eq!(resume(&checkpoint[..40]), Some(CheckpointError::Mismatch));
    assert_eq!(resume(&checkpoint), None);
}

#[test]
fn a_cancelled_round_leaves_the_finished_ones_as_they_are() {
    let mut render = new_render();
    render.run_round(&Control::new()).unwrap();
    let before = bits(&render);
    let control = Control::new();
    control.cancel();
    assert_eq!(render.run_round(&control), Err(RenderError::Cancelled));
    assert_eq!((render.rounds(), bits(&render) == before), (1, true));
}

#[test]
fn another_seed_gives_another_picture() {
    let picture = |seed: u64| {
        let mut scene = compile(&value());
        scene.render.seed = seed;
        let plan = Plan::new(&scene);
        let mut render = Render::new(Arc::new(scene), plan);
        render.run_round(&Control::new()).unwrap();
        bits(&render)
    };
    assert!(picture(0) != picture(1));
}
