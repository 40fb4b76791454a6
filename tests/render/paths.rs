//! Light-path expressions: what they match, what walks carry for them, and the layers they make.

use crate::support::{
    Estimate, SEEDS, T_LIMIT, camera_above, compile, floor, over_seeds, render, render_scene, scene,
};
use nephroid::image_io::LinearImage;
use nephroid::light_path::{Bounce, Expression, Language, Layers, PathClass, Paths, Share, Trail};
use nephroid::plan::{Layer, Plan};
use nephroid::render::{Control, Render};
use nephroid::scene::{DirectoryAssets, Scene};
use serde_json::{Value, json};
use std::path::Path;
use std::sync::Arc;

/// All strings of D and S of up to `most` letters.
fn all_paths(most: u32) -> impl Iterator<Item = Vec<Bounce>> {
    (0..=most).flat_map(|length| {
        (0..1_u32 << length)
            .map(move |bits| (0..length).map(|i| Bounce::ALL[(bits >> i & 1) as usize]).collect())
    })
}

fn expression(text: &str) -> Expression {
    text.parse().unwrap_or_else(|error| panic!("{text}: {error}"))
}

#[test]
fn each_path_to_ten_bounces_has_one_class_and_one_estimator() {
    let classes = PathClass::ALL.map(|class| (class, expression(class.expression())));
    // The eye meets the emitter; a shadow ray meets it; a photon rests.
    let estimators = ["LS*E", "LD(D|S)*E", "LS+D(D|S)*E"].map(expression);
    for path in all_paths(10) {
        let found: Vec<PathClass> =
            classes.iter().filter(|(_, e)| e.matches(&path)).map(|(class, _)| *class).collect();
        assert_eq!(found, [PathClass::of(&path)], "{path:?}");
        assert_eq!(estimators.iter().filter(|e| e.matches(&path)).count(), 1, "{path:?}");
        assert!(Paths::Complete.matches(&path));
        assert_eq!(Paths::Caustics.matches(&path), PathClass::of(&path) != PathClass::Indirect);
    }
}

#[test]
fn expressions_match_what_they_say() {
    use Bounce::{Diffuse as D, Specular as S};
    type Case = (&'static str, &'static [&'static [Bounce]], &'static [&'static [Bounce]]);
    let cases: [Case; 8] = [
        ("LE", &[&[]], &[&[D], &[S]]),
        ("LS+E", &[&[S], &[S, S]], &[&[], &[S, D], &[D]]),
        ("L.E", &[&[D], &[S]], &[&[], &[D, D]]),
        ("LD?S{2}E", &[&[S, S], &[D, S, S]], &[&[S], &[S, S, S], &[D, D, S, S]]),
        ("L S{2,3} D E", &[&[S, S, D], &[S, S, S, D]], &[&[S, D], &[S, S, S, S, D]]),
        ("L(SD){2,}E", &[&[S, D, S, D], &[S, D, S, D, S, D]], &[&[S, D], &[]]),
        ("(LD|LS)(D|S)*E", &[&[D], &[S, D, S]], &[&[]]),
        ("L(D{0}|S{0,1}D)E", &[&[], &[D], &[S, D]], &[&[S], &[D, D]]),
    ];
    for (text, yes, no) in cases {
        let expression = expression(text);
        yes.iter().for_each(|path| assert!(expression.matches(path), "{text} {path:?}"));
        no.iter().for_each(|path| assert!(!expression.matches(path), "{text} {path:?}"));
    }
}

#[test]
fn what_is_no_light_path_is_refused_at_its_column() {
    let cases = [
        ("DE", 1, "begins with L"),
        ("LS*", 2, "ends with E"),
        ("LS*E|LD*", 7, "ends with E"),
        ("LDLE", 3, "L stands only"),
        ("LEE", 2, "E stands only"),
        ("(LE)?", 1, "may be empty"),
        ("L(D{1,100}){100}E", 3, "longer than"),
        ("L((D{0}){1000}){1000}E", 9, "repeats too much"),
    ];
    for (text, column, message) in cases {
        let error = text.parse::<Expression>().unwrap_err();
        assert!(error.message.contains(message), "{text}: {error}");
        assert_eq!(error.column, column, "{text}: {error}");
    }
    // A D that stands twenty places before the eye: 2^20 states.
    assert!("L(D|S)*D(D|S){20}E".parse::<Expression>().is_err());
    assert!("whited".parse::<Paths>().unwrap_err().to_string().contains("`whitted`"));
}

/// What a photon and an eye's ray carry gives, put together at any D, what the whole path says.
#[test]
fn the_two_walks_together_know_the_path() {
    let texts = ["LS{1}DS*E", "L(SS)+D(D|S)*E", "L.*DSE", "LS+E|LDS{2}E", "L(S|DS)*DE"];
    let layers = texts.map(expression);
    let paths: Paths = "LS*E|L(D|S)*DS{0,3}E".parse().unwrap();
    let groups = Layers {
        expressions: layers.iter().collect(),
        groups: 2,
        group_of: vec![Some(0), Some(1), None, Some(1)],
    };
    let language = Language::new(&paths, &groups).unwrap();
    for path in all_paths(10) {
        let holds = |light: usize| {
            if !paths.matches(&path) {
                return 0;
            }
            let matched = layers.iter().enumerate().filter(|(_, layer)| layer.matches(&path));
            let group = groups.group_of[light].map_or(0, |group| 1 << (1 + layers.len() + group));
            matched.fold(1 | group, |set, (i, _)| set | 1 << (i + 1))
        };
        let trail = |from: usize| {
            path[from..].iter().rev().fold(Trail::default(), |trail, &bounce| language.step(trail, bounce))
        };
        for light in 0..2 {
            assert_eq!(language.pictures(trail(0), language.straight_from(light)), holds(light), "{path:?}");
            let specular = path.iter().take_while(|b| **b == Bounce::Specular).count();
            if specular > 0 && specular < path.len() {
                let kind = language.photons_from(Some(light)).after(specular as u32);
                let found = kind.map_or(0, |kind| language.pictures(trail(specular), kind));
                assert_eq!(found, holds(light), "{path:?}");
            }
        }
        assert_eq!(language.pictures(trail(0), language.straight_from_environment()), holds(2), "{path:?}");
        assert_eq!(language.pictures(trail(0), language.glow()), holds(3), "{path:?}");
    }
}

#[test]
fn paths_that_are_whole_classes_need_nothing_carried() {
    for (text, classes) in [
        ("LS*E|LDS*E", vec![PathClass::Emitted, PathClass::Direct]),
        ("LS+DS*E", vec![PathClass::Caustic]),
        ("L.*E", PathClass::ALL.to_vec()),
        ("L(S*D)?S*E", vec![PathClass::Emitted, PathClass::Direct, PathClass::Caustic]),
    ] {
        let paths: Paths = text.parse().unwrap();
        assert!(paths.are_whole_classes(), "{text}");
        assert_eq!(paths.classes(), classes, "{text}");
    }
    let part: Paths = "LSDE".parse().unwrap();
    assert_eq!(
        PathClass::ALL.map(|c| part.share(c)),
        [Share::Nothing, Share::Nothing, Share::Part, Share::Nothing]
    );
}

/// The picture of an expression is that of the preset with the same paths, to the bit.
#[test]
fn an_expression_that_is_a_preset_is_rendered_as_one() {
    let mut value = beside_a_ball();
    let [preset, expression] = ["caustics", "LS*E | L S* D S* E"].map(|paths| {
        value["render"]["paths"] = json!(paths);
        render(&value, 1, 3, 10).image()
    });
    assert!(preset == expression);
}

/// A glass ball, a mirror and a wall over a floor in a quad's and a point's light.
fn beside_a_ball() -> Value {
    let objects = json!([
        floor(3.0, 0.0),
        { "type": "sphere", "material": "glass", "center": [0, 0.55, 0], "radius": 0.5 },
        { "type": "polygon", "material": "floor", "vertices": [[-2, 0, 1.2], [1, 0, 1.2], [1, 1, 1.2], [-2, 1, 1.2]] },
        { "type": "polygon", "material": "mirror", "vertices": [[-1.5, 0, 1], [-1.5, 0, -1], [-1.5, 1, -1], [-1.5, 1, 1]] }]);
    let lights = json!([
        { "type": "quad", "center": [1.2, 3.0, 0.6], "size": [0.8, 0.8], "towards": [0, 0.55, 0], "radiance": [9, 9, 9], "group": "window" },
        { "type": "point", "position": [1, 2, -1], "intensity": [4, 4, 4] }]);
    let mut value = scene(camera_above([-0.6, 0.0, 0.0], 3.0, 3.0), objects, lights);
    value["image"] = json!({ "width": 24, "height": 24 });
    value
}

fn sum(render: &Render, layers: &[Layer]) -> LinearImage {
    let picture = render.picture();
    let parts: Vec<LinearImage> = layers.iter().map(|layer| picture.part(layer)).collect();
    let pixel = |i: usize| std::array::from_fn(|c| parts.iter().map(|part| part.pixels[i][c]).sum());
    LinearImage { pixels: (0..parts[0].pixels.len()).map(pixel).collect(), ..parts[0] }
}

/// Layers are summed in another order than the picture: rounding of f32 over some hundred terms.
fn assert_same(what: &str, image: &LinearImage, sum: &LinearImage) {
    let mean =
        image.pixels.iter().flatten().map(|x| f64::from(*x)).sum::<f64>() / (3 * image.pixels.len()) as f64;
    for (i, (a, b)) in image.pixels.iter().zip(&sum.pixels).enumerate() {
        for (a, b) in a.iter().zip(b) {
            let (a, b) = (f64::from(*a), f64::from(*b));
            assert!((a - b).abs() <= 1e-4 * (a.abs() + mean), "{what}, pixel {i}: {a} {b}");
        }
    }
}

/// Two ways to part all paths, by what they meet first and last; and the scene's lights.
fn part_by_ends_and_lights(value: &mut Value) {
    value["render"]["layers"] = json!({
        "straight": "L(D.*)?E", "through": "LS.*E",
        "bare": "L(.*D)?E", "mirrored": "L.*SE" });
    let lights = value.get_mut("lights").and_then(Value::as_array_mut);
    lights.into_iter().flatten().enumerate().for_each(|(i, light)| {
        if i > 0 {
            light["group"] = json!(format!("light_{}", i % 3));
        }
    });
}

fn assert_parts_add_up(name: &str, render: &Render) {
    let image = render.image();
    let layers = render.layers();
    let named = |names: &[&str]| -> Vec<Layer> {
        layers.iter().filter(|layer| names.contains(&layer.name())).cloned().collect()
    };
    let classes: Vec<Layer> = layers.iter().filter(|l| matches!(l, Layer::Class(_))).cloned().collect();
    assert_same(&format!("{name}, classes"), &image, &sum(render, &classes));
    assert_same(&format!("{name}, first"), &image, &sum(render, &named(&["straight", "through"])));
    assert_same(&format!("{name}, last"), &image, &sum(render, &named(&["bare", "mirrored"])));
    let groups = named(&["ungrouped", "light_0", "light_1", "light_2", "window"]);
    if !groups.is_empty() {
        assert_same(&format!("{name}, lights"), &image, &sum(render, &groups));
    }
}

/// Every sample scene, small, with its own paths and with all.
#[test]
fn the_layers_of_every_sample_scene_add_up_to_the_picture() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let assets = DirectoryAssets::new(&folder);
    let mut names: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    names.sort();
    for path in names.iter().filter(|path| path.extension().is_some_and(|e| e == "json")) {
        let mut value: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
        part_by_ends_and_lights(&mut value);
        value["image"] = json!({ "width": 32, "height": 24 });
        for paths in
            [value["render"]["paths"].as_str().unwrap_or("caustics").to_owned(), "complete".to_owned()]
        {
            value["render"]["paths"] = json!(paths);
            let scene = Scene::from_json(&value.to_string(), &assets).unwrap_or_else(|e| panic!("{e}"));
            let name = format!("{} {paths}", path.display());
            assert_parts_add_up(&name, &render_scene(scene, 1, 3, 9));
        }
    }
}

#[test]
fn the_layers_of_the_rivals_add_up_too() {
    for (field, rule) in [
        ("caustics", json!("backward")),
        ("caustics", json!("forward")),
        ("radius", json!("progressive")),
        ("radius", json!({ "fixed": 0.1 })),
        ("radius", json!({ "nearest": 20, "most": 0.3 })),
    ] {
        let mut value = beside_a_ball();
        part_by_ends_and_lights(&mut value);
        value["render"]["paths"] = json!("complete");
        value["render"][field] = rule.clone();
        assert_parts_add_up(&rule.to_string(), &render(&value, 1, 3, 9));
    }
}

/// A resumed render has the same layers, to the bit.
#[test]
fn layers_survive_a_checkpoint() {
    let mut value = beside_a_ball();
    part_by_ends_and_lights(&mut value);
    let straight = render(&value, 1, 3, 9);
    let bytes = straight.checkpoint();
    let plan = straight.plan().clone();
    let mut scene = compile(&value);
    scene.render.seed = 1;
    let resumed = Render::resume(Arc::new(scene), plan, &bytes).unwrap();
    for layer in straight.layers() {
        assert!(straight.picture().part(&layer) == resumed.picture().part(&layer), "{layer:?}");
    }
}

/// Light of the picture, or of one of its layers: mean over seeds, all with the plan of one.
fn light(value: &Value, layer: Option<&str>) -> Estimate {
    let first = compile(value);
    let mut plan = Plan::new(&first);
    plan.photons.iter_mut().for_each(|budget| budget.log2_block = 9);
    over_seeds(|seed| {
        let mut scene = compile(value);
        scene.render.seed = seed + if layer.is_some() { 0 } else { SEEDS };
        let mut render = Render::new(Arc::new(scene), plan.clone());
        (0..8).for_each(|_| _ = render.run_round(&Control::new()).unwrap());
        let picture = render.picture();
        let part = |name| render.layers().into_iter().find(|layer| layer.name() == name).unwrap();
        let image = layer.map_or_else(|| picture.image(), |name| picture.part(&part(name)));
        image.pixels.iter().map(|p| f64::from(p[1])).sum()
    })
}

/// They agree, and a quarter more or less would have been found: what is in a wrong layer is far more.
fn assert_agree(what: &str, a: Estimate, b: Estimate) {
    let error = a.standard_error.hypot(b.standard_error);
    assert!(T_LIMIT * error < 0.25 * b.mean, "too noisy to tell: {what} {a:?} {b:?}");
    assert!((a.mean - b.mean).abs() <= T_LIMIT * error, "{what}: {a:?} {b:?}");
}

/// A layer of a picture is what a render of its paths alone gives: there photons of other paths are not kept, and here they
/// are told apart when they are looked up.
#[test]
fn a_layer_is_the_picture_of_its_paths() {
    let mut value = beside_a_ball();
    value["lights"].as_array_mut().unwrap().remove(0);
    for paths in ["LSDE", "LS{2}DE", "LS{2,}D.*E", "LS+DSE|LDSE", "LDDE|LSSDDE"] {
        value["render"] =
            json!({ "paths": "complete", "layers": { "part": paths }, "stop": { "rounds": 1 } });
        let layer = light(&value, Some("part"));
        value["render"] = json!({ "paths": paths, "stop": { "rounds": 1 } });
        assert_agree(paths, layer, light(&value, None));
    }
}

/// The light of a group is that of the scene with its lights alone.
#[test]
fn a_light_group_is_the_light_of_its_lights() {
    let value = beside_a_ball();
    for (name, index) in [("window", 0), ("ungrouped", 1)] {
        let mut alone = value.clone();
        alone["lights"] = json!([value["lights"][index]]);
        assert_agree(name, light(&value, Some(name)), light(&alone, None));
    }
}

/// What is not asked for, or cannot occur, is not run, and the plan says why.
#[test]
fn the_plan_leaves_out_what_the_paths_do_not_hold() {
    let plan = |paths: &str| {
        let mut value = beside_a_ball();
        value["render"]["paths"] = json!(paths);
        Plan::new(&compile(&value))
    };
    let runs = |plan: &Plan, topic: &str| plan.decisions.iter().find(|d| d.topic == topic).unwrap().runs;
    let topics = ["pass 1", "emitted light", "direct light", "indirect light"];
    for (paths, expected) in [
        ("LS*E", [false, true, false, false]),
        ("LDE", [false, false, true, false]),
        ("LS+DE", [true, false, false, false]),
        ("LSDDE", [true, false, false, true]),
        ("LD{2}E", [false, false, true, true]),
        ("L.*E", [true; 4]),
    ] {
        let plan = plan(paths);
        assert_eq!(topics.map(|topic| runs(&plan, topic)), expected, "{paths}");
        assert!(plan.decisions.iter().all(|d| !d.reason.is_empty()));
    }
    // No shadow ray is traced, and no photon, for what only shows the lights.
    let mut value = beside_a_ball();
    value["render"]["paths"] = json!("LS*E");
    let stats = render(&value, 1, 2, 9).stats();
    assert_eq!((stats.eye.shadow_rays, stats.eye.lookups, stats.windows.len()), (0, 0, 0));
    // A point light cannot be seen.
    value["lights"] = json!([value["lights"][1]]);
    assert!(!runs(&Plan::new(&compile(&value)), "emitted light"));
}
