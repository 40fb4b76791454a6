//! From a scene to its picture.

use crate::server::{Server, endless, png_size, quick, scene};
use nephroid::image_io::{ImageFormat, decode};
use reqwest::StatusCode;
use serde_json::Value;

#[tokio::test]
async fn a_scene_becomes_a_picture() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let answer = server.post("/v1/renders", quick().to_string()).await;
    assert_eq!(answer.status(), StatusCode::ACCEPTED);
    assert!(answer.headers().contains_key("retry-after"));
    let location = answer.headers()["location"].to_str().unwrap().to_owned();
    let job: Value = answer.json().await.unwrap();
    assert_eq!(location, format!("/v1/renders/{}", job["id"].as_str().unwrap()));
    assert_eq!(job["state"], "queued");

    let done = server.wait_for_state(job["id"].as_str().unwrap(), "succeeded").await;
    assert_eq!(done["progress"], 1.0);
    assert_eq!(done["rounds"], 2);
    assert_eq!(done["stop_reason"], "rounds");
    assert!(done["plan"]["decisions"].as_array().is_some_and(|list| !list.is_empty()));
    assert!(done["stats"].is_object());
    assert_eq!(png_size(&server.png(job["id"].as_str().unwrap()).await), [48, 36]);
}

#[tokio::test]
async fn every_link_of_a_finished_job_leads_somewhere() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let id = server.submit(&quick()).await;
    let job = server.wait_for_state(&id, "succeeded").await;
    let links = job["links"].as_object().unwrap();
    for wanted in ["self", "scene", "image", "exr", "layer_caustic", "layer_direct", "exr_emitted"] {
        let path = links[wanted].as_str().unwrap();
        assert_eq!(server.get(path).await.status(), StatusCode::OK, "{path}");
    }
    let exr = server.get(links["exr"].as_str().unwrap()).await.bytes().await.unwrap();
    assert_eq!(&exr[..4], [0x76, 0x2f, 0x31, 0x01], "the magic number of OpenEXR");
    let sent: Value = server.get_json(links["scene"].as_str().unwrap()).await;
    assert_eq!(sent, quick());
}

#[tokio::test]
async fn the_layers_of_the_classes_add_up_to_the_picture() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let id = server.submit(&quick()).await;
    let job = server.wait_for_state(&id, "succeeded").await;
    let read = async |path: &Value| {
        let answer = server.get(path.as_str().unwrap()).await;
        assert_eq!(answer.headers()["content-type"], "image/x-exr");
        decode(&answer.bytes().await.unwrap(), ImageFormat::Exr).unwrap()
    };
    let whole = read(&job["links"]["exr"]).await;
    let mut sum = vec![0.0; 3 * whole.pixels.len()];
    for class in ["emitted", "direct", "caustic"] {
        let layer = read(&job["links"][format!("exr_{class}")]).await;
        sum.iter_mut().zip(layer.pixels.iter().flatten()).for_each(|(sum, light)| *sum += light);
    }
    // Three roundings of 32-bit floats.
    let off = |(sum, whole): (&f32, &f32)| (sum - whole).abs() > 4.0 * f32::EPSILON * whole.abs();
    assert_eq!(sum.iter().zip(whole.pixels.iter().flatten()).filter(|pair| off(*pair)).count(), 0);
}

#[tokio::test]
async fn whoever_waits_gets_the_finished_job() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let request = server.client.post(server.url("/v1/renders")).header("content-type", "application/json");
    let answer = request.header("prefer", "wait=600").body(quick().to_string()).send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::OK);
    assert_eq!(answer.headers()["preference-applied"], "wait=30", "longer than gateways allow is cut");
    let job: Value = answer.json().await.unwrap();
    assert_eq!(job["state"], "succeeded");
}

#[tokio::test]
async fn a_wait_that_is_too_short_ends_with_202() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let request = server.client.post(server.url("/v1/renders")).header("content-type", "application/json");
    let answer = request.header("prefer", "wait=1").body(endless().to_string()).send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::ACCEPTED);
    assert_eq!(answer.headers()["preference-applied"], "wait=1");
}

#[tokio::test]
async fn an_unfinished_picture_can_be_watched() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let id = server.submit(&endless()).await;
    let job = server.wait_for(&id, |job| job["rounds"].as_u64() > Some(0)).await;
    assert!(job["progress"].as_f64().unwrap() < 1.0);
    let preview = server.get(&format!("/v1/renders/{id}/preview.png")).await;
    assert_eq!(preview.status(), StatusCode::OK);
    assert_eq!(preview.headers()["cache-control"], "no-store");
    assert_eq!(png_size(&preview.bytes().await.unwrap()), [320, 240]);
}

#[tokio::test]
async fn a_picture_that_is_not_there_yet_is_a_conflict_that_says_so() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let id = server.submit(&endless()).await;
    for path in ["image.png", "image.exr", "layers/caustic.png"] {
        let answer = server.get(&format!("/v1/renders/{id}/{path}")).await;
        assert_eq!(answer.status(), StatusCode::CONFLICT);
        assert_eq!(answer.headers()["content-type"], "application/problem+json");
        assert_eq!(answer.headers()["retry-after"], "1");
        let problem: Value = answer.json().await.unwrap();
        assert_eq!(problem["done"], false);
        assert!(["queued", "running"].contains(&problem["state"].as_str().unwrap()));
    }
}

#[tokio::test]
async fn validating_and_planning_leave_no_job() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let plan: Value = server.post("/v1/plans", quick().to_string()).await.json().await.unwrap();
    assert!(plan["decisions"].as_array().is_some_and(|list| !list.is_empty()));
    let answer = server.post("/v1/renders?validate_only=true", quick().to_string()).await;
    assert_eq!(answer.status(), StatusCode::OK);
    let valid: Value = answer.json().await.unwrap();
    assert_eq!(valid["plan"], plan);
    assert_eq!(server.get_json("/v1/renders").await["renders"], serde_json::json!([]));
}

#[tokio::test]
async fn the_same_scene_gives_the_same_bytes_on_any_number_of_threads() {
    let mut pictures = Vec::new();
    for threads in ["1", "3"] {
        let data = tempfile::tempdir().unwrap();
        let server = Server::start(data.path(), &["--threads", threads]);
        let id = server.submit(&scene([64, 48], 3)).await;
        server.wait_for_state(&id, "succeeded").await;
        pictures.push(server.png(&id).await);
    }
    assert!(pictures[0] == pictures[1]);
}
