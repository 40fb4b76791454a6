//! A chart of a tiny scene: every method has its line, and every page says so.

use crate::support::{camera_above, floor, scene};
use nephroid::lab::methods::methods;
use nephroid::lab::scaling::{csv, draw, measure_scaling};
use nephroid::lab::table::{self, SceneResults, reference_from, reference_json};
use nephroid::lab::{
    Budget, Chart, End, Origin, PeerRun, Reference, Shot, Subject, Task, honesty, measure_reference, page,
    peer_curve, run_method, svg, time_structures, without_lamps,
};
use nephroid::plan::Plan;
use nephroid::scene::{MemoryAssets, NoAssets};
use serde_json::{Value, json};

/// Every method makes at least a round; none waits for a clock.
const BUDGET: Budget = Budget { seconds: 0.01, reference: 0.05 };

fn tiny() -> Value {
    let ball = json!({ "type": "sphere", "material": "glass", "center": [0, 0.55, 0], "radius": 0.5 });
    let light = json!({ "type": "quad", "center": [1.2, 3, 0.6], "size": [1, 1], "towards": [0, 0, 0],
                        "radiance": [9, 7, 5] });
    let mut value =
        scene(camera_above([-0.4, 0.0, -0.2], 1.0, 1.0), json!([floor(3.0, 0.0), ball]), json!([light]));
    value["image"] = json!({ "width": 24, "height": 18 });
    value
}

fn results() -> SceneResults {
    let subject = Subject::new("tiny", &tiny().to_string(), &NoAssets, None).unwrap();
    let scene = subject.scene(&json!({}), 0).unwrap();
    let plan = Plan::new(&scene);
    let chart = |task: Task| {
        let reference = measure_reference(&subject, task, BUDGET).unwrap();
        let methods = methods(&scene, &plan, task);
        let curves = methods.iter().map(|m| run_method(&subject, m, &reference, BUDGET).unwrap()).collect();
        Chart { scene: "tiny".to_owned(), task, reference, curves }
    };
    let charts = vec![chart(Task::Picture), chart(Task::DirectLight)];
    let honesty = honesty(&subject, &charts[0].reference, 2, 0.01).unwrap();
    SceneResults {
        scene: "tiny".to_owned(),
        charts,
        timings: time_structures(&subject).unwrap(),
        honesty: Some((honesty, 0.01)),
    }
}

#[test]
fn a_chart_has_all_methods_and_finite_lines() {
    let results = results();
    let names: Vec<usize> = results.charts.iter().map(|c| c.curves.len()).collect();
    assert_eq!(names, [8, 5]);
    for point in results.charts.iter().flat_map(|c| &c.curves).flat_map(|c| &c.points) {
        assert!(point.cpu > 0.0 && point.cpu.is_finite() && point.error > 0.0 && point.error.is_finite());
    }
    assert_eq!(results.timings.len(), 4);
    let (rows, _) = results.honesty.as_ref().unwrap();
    assert!(rows.iter().all(|row| row.stopped + row.not_reached == 2));
    for chart in &results.charts {
        assert!(chart.reference.error > 0.0 && chart.reference.error.is_finite());
        let drawn = svg::draw(chart);
        assert!(!drawn.contains("NaN") && !drawn.contains("inf"), "{drawn}");
        assert!(chart.curves.iter().all(|c| drawn.contains(&c.method.name)), "{drawn}");
    }
    let csv = table::csv(&[&results]);
    let points: usize = results.charts.iter().flat_map(|c| &c.curves).map(|c| c.points.len()).sum();
    assert_eq!(csv.lines().count(), 1 + points);
    let tables = table::markdown(&[&results]);
    assert!(
        results
            .charts
            .iter()
            .flat_map(|c| &c.curves)
            .all(|c| tables.contains(&format!("| {} |", c.method.name)))
    );
    let settings = crate::support::compile(&tiny()).image;
    let html = page::page(&[(results, settings)], &[]).unwrap();
    assert!(html.matches("<svg").count() == 2 && html.contains("data:image/png;base64,"));
    assert!(!html.contains("src=\"http"), "the page needs no other file");
}

#[test]
fn a_reference_is_read_as_it_was_written() {
    let subject = Subject::new("tiny", &tiny().to_string(), &NoAssets, None).unwrap();
    let reference = measure_reference(&subject, Task::Picture, BUDGET).unwrap();
    let read = reference_from(&reference_json(&reference), reference.halves.clone());
    assert_eq!(read, Some(reference));
}

#[test]
fn a_scene_without_area_lights_has_no_chart_of_direct_light() {
    let mut value = tiny();
    value["lights"] = json!([{ "type": "point", "position": [1, 3, 1], "intensity": [5, 5, 5] }]);
    let subject = Subject::new("tiny", &value.to_string(), &NoAssets, None).unwrap();
    let scene = subject.scene(&json!({}), 0).unwrap();
    let plan = Plan::new(&scene);
    assert!(methods(&scene, &plan, Task::DirectLight).is_empty());
    let names: Vec<String> = methods(&scene, &plan, Task::Picture).into_iter().map(|m| m.name).collect();
    assert!(!names.iter().any(|name| name.starts_with("backward")), "no path meets a point: {names:?}");
}

/// Another renderer's picture is judged by the same reference: twice the reference is off by its root mean square over its
/// mean, and where the reference cannot tell, the line ends.
#[test]
fn the_pictures_of_other_renderers_are_charted_by_the_same_reference() {
    let subject = Subject::new("tiny", &tiny().to_string(), &NoAssets, None).unwrap();
    // So short a reference is noisy; this one is taken to be known to 0.1 %, which in squares changes 1e-6.
    let measured = measure_reference(&subject, Task::Complete, BUDGET).unwrap();
    let half = |share: f32| {
        let mut image = measured.image.clone();
        image.pixels.iter_mut().flatten().for_each(|x| *x *= share);
        image
    };
    let reference = Reference { halves: [half(0.999), half(1.001)], ..measured.clone() };
    let mut twice = reference.image.clone();
    twice.pixels.iter_mut().flatten().for_each(|x| *x *= 2.0);
    let mask = reference.mask.clone().unwrap();
    let kept =
        || reference.image.pixels.iter().zip(&mask).filter(|(_, kept)| **kept).flat_map(|(pixel, _)| pixel);
    let values = || kept().map(|x| f64::from(*x));
    let count = values().count() as f64;
    let known = (values().map(|x| x * x).sum::<f64>() / count).sqrt() / (values().sum::<f64>() / count);
    let shots = vec![Shot { cpu: 1.0, image: twice }, Shot { cpu: 2.0, image: reference.image.clone() }];
    let curve = peer_curve(PeerRun { name: "other".to_owned(), shots }, &reference, 1.0).unwrap();
    assert_eq!((curve.points.len(), &curve.end, &curve.peer), (1, &End::Reference, &Some(Origin::SameRun)));
    assert!((curve.points[0].error / known - 1.0).abs() < 1e-5, "{} {known}", curve.points[0].error);
    let chart = Chart { scene: "tiny".to_owned(), task: Task::Complete, reference, curves: vec![curve] };
    assert!(svg::draw(&chart).contains("stroke-dasharray=\"8 5\""));
}

/// A lamp and what shows it are left out where renderers are compared: of the tiny scene the ball's highlights, and no more
/// than a tenth of it; of one that shows lamp alone, nothing, since nothing would be left.
#[test]
fn pixels_that_show_a_lamp_are_not_compared() {
    let mask = |value: &Value| {
        let subject = Subject::new("tiny", &value.to_string(), &NoAssets, None).unwrap();
        without_lamps(&subject).unwrap()
    };
    let mut value = tiny();
    value["camera"] = json!({ "type": "perspective", "eye": [0, 2, 5], "target": [0.6, 1.5, 0], "fov": 60 });
    let found = mask(&value).unwrap();
    let left_out = found.iter().filter(|kept| !**kept).count();
    assert!(left_out > 0 && 2 * left_out < found.len(), "{left_out} of {}", found.len());
    value["environment"] = json!({ "radiance": [1, 1, 1] });
    value["objects"] = json!([value["objects"][1]]);
    assert_eq!(mask(&value), None);
}

/// A reference is stored under a number that also changes with the files that a scene names.
#[test]
fn a_changed_file_makes_another_subject() {
    let mut value = tiny();
    value["objects"][1] = json!({ "type": "mesh", "asset": "a.obj", "material": "glass" });
    let hash = |obj: &str| {
        let mut assets = MemoryAssets::default();
        assets.files.insert("a.obj".to_owned(), obj.into());
        Subject::new("tiny", &value.to_string(), &assets, None).unwrap().hash()
    };
    let (one, other) = ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "v 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n");
    assert_eq!(hash(one), hash(one));
    assert_ne!(hash(one), hash(other));
}

#[test]
fn times_over_sizes_are_drawn() {
    let scalings = measure_scaling(1e-3).unwrap();
    assert_eq!(scalings.len(), 5);
    for measured in &scalings {
        let points = || measured.series.iter().flat_map(|s| &s.points);
        assert!(
            points().count() > 0 && points().all(|(size, time)| *size > 0.0 && *time > 0.0),
            "{measured:?}"
        );
        let drawn = draw(measured);
        assert!(!drawn.contains("NaN") && measured.series.iter().all(|s| drawn.contains(s.name)), "{drawn}");
    }
    let points: usize = scalings.iter().flat_map(|s| &s.series).map(|s| s.points.len()).sum();
    assert_eq!(csv(&scalings).lines().count(), 1 + points);
}
