//! How the service stops.

use crate::server::{Server, endless, quick, scene, until};
use clap::Parser;
use nephroid_api::config::{Cli, Command};
use nephroid_api::{AppState, router, serve};
use reqwest::StatusCode;
use tokio::net::TcpListener;

#[tokio::test]
async fn a_stopped_service_goes_on_where_it_was() {
    let long = scene([160, 120], 40);
    let calm = tempfile::tempdir().unwrap();
    let undisturbed = Server::start(calm.path(), &[]);
    let reference = undisturbed.submit(&long).await;
    undisturbed.wait_for_state(&reference, "succeeded").await;

    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let id = server.submit(&long).await;
    server.wait_for(&id, |job| job["rounds"].as_u64() >= Some(3)).await;
    assert!(server.terminate().await.success());

    let again = Server::start(data.path(), &[]);
    let job = again.wait_for_state(&id, "succeeded").await;
    assert_eq!(job["attempt"], 2);
    assert!(again.png(&id).await == undisturbed.png(&reference).await);
}

#[tokio::test]
async fn stopping_does_not_wait_for_the_render() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    // It would take hours.
    let id = server.submit(&scene([2400, 1800], 1000)).await;
    server.wait_for_state(&id, "running").await;
    assert!(server.terminate().await.success());
}

#[tokio::test]
async fn stopping_any_number_of_times_is_no_failure_of_the_job() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let id = server.submit(&endless()).await;
    server.wait_for_state(&id, "running").await;
    assert!(server.terminate().await.success());
    for attempt in 2..=4 {
        let server = Server::start(data.path(), &[]);
        let job = server.wait_for_state(&id, "running").await;
        assert_eq!(job["attempt"], attempt);
        assert!(server.terminate().await.success());
    }
}

#[tokio::test]
async fn a_service_that_stops_is_not_ready_and_takes_no_jobs() {
    let data = tempfile::tempdir().unwrap();
    let command = Cli::parse_from(["nephroid-api", "--data", data.path().to_str().unwrap()]).into_command();
    let Command::Serve(settings) = command else { panic!("to serve is the default") };
    let state = tokio::task::spawn_blocking(|| AppState::open(*settings)).await.unwrap().unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    serve(listener, state.clone(), std::future::ready(())).await.unwrap();

    // The service has drained; its routes on another listener answer as they did meanwhile.
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let base = format!("http://{}", listener.local_addr().unwrap());
    tokio::spawn(axum::serve(listener, router(state)).into_future());
    let client = reqwest::Client::new();
    let ready = until(async || client.get(format!("{base}/readyz")).send().await.ok()).await;
    assert_eq!(ready.status(), StatusCode::SERVICE_UNAVAILABLE);
    let request = client.post(format!("{base}/v1/renders")).header("content-type", "application/json");
    let refused = request.body(quick().to_string()).send().await.unwrap();
    assert_eq!(refused.status(), StatusCode::SERVICE_UNAVAILABLE);
    assert!(refused.headers().contains_key("retry-after"));
    assert_eq!(client.get(format!("{base}/healthz")).send().await.unwrap().status(), StatusCode::OK);
}
