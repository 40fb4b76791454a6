//! A chart of a tiny scene: every method has its line, and every page says so.

use crate::support::{camera_above, floor, scene};
use nephroid::lab::methods::methods;
use nephroid::lab::table::{self, SceneResults, reference_from, reference_json};
use nephroid::lab::{
    Budget, Chart, Subject, Task, honesty, measure_reference, page, run_method, svg, time_structures,
};
use nephroid::plan::Plan;
use nephroid::scene::NoAssets;
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
    SceneResults { scene: "tiny".to_owned(), charts, timings: time_structures(&subject).unwrap(), honesty }
}

#[test]
fn a_chart_has_all_methods_and_finite_lines() {
    let results = results();
    let names: Vec<usize> = results.charts.iter().map(|c| c.curves.len()).collect();
    assert_eq!(names, [7, 5]);
    for point in results.charts.iter().flat_map(|c| &c.curves).flat_map(|c| &c.points) {
        assert!(point.cpu > 0.0 && point.cpu.is_finite() && point.error > 0.0 && point.error.is_finite());
    }
    assert_eq!(results.timings.len(), 4);
    assert!(results.honesty.iter().all(|row| row.stopped + row.not_reached == 2));
    for chart in &results.charts {
        assert!(chart.reference.error > 0.0 && chart.reference.error.is_finite());
        let drawn = svg::draw(chart);
        assert!(!drawn.contains("NaN") && !drawn.contains("inf"), "{drawn}");
        assert!(chart.curves.iter().all(|c| drawn.contains(&c.method.name)), "{drawn}");
    }
    let csv = table::csv(&[&results]);
    let points: usize = results.charts.iter().flat_map(|c| &c.curves).map(|c| c.points.len()).sum();
    assert_eq!(csv.lines().count(), 1 + points);
    let settings = crate::support::compile(&tiny()).image;
    let html = page::page(&[(results, settings)]).unwrap();
    assert!(html.matches("<svg").count() == 2 && html.contains("data:image/png;base64,"));
    assert!(!html.contains("src=\"http"), "the page needs no other file");
}

#[test]
fn a_reference_is_read_as_it_was_written() {
    let subject = Subject::new("tiny", &tiny().to_string(), &NoAssets, None).unwrap();
    let reference = measure_reference(&subject, Task::Picture, BUDGET).unwrap();
    let read = reference_from(&reference_json(&reference), reference.image.clone());
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
