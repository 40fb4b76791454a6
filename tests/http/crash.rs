//! What a crash leaves, and what becomes of it.

use crate::server::{Server, endless, quick, scene, until};

#[tokio::test]
async fn a_killed_service_finishes_the_job_to_the_same_bytes() {
    // More rounds than fit between two checkpoints.
    let long = scene([160, 120], 60);
    let calm = tempfile::tempdir().unwrap();
    let undisturbed = Server::start(calm.path(), &[]);
    let reference = undisturbed.submit(&long).await;
    undisturbed.wait_for_state(&reference, "succeeded").await;

    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let id = server.submit(&long).await;
    let checkpoint = data.path().join("jobs").join(&id).join("checkpoint");
    until(async || checkpoint.exists().then_some(())).await;
    assert_eq!(server.job(&id).await["state"], "running", "the job must not be done before it is disturbed");
    server.kill();

    let again = Server::start(data.path(), &[]);
    let job = again.wait_for_state(&id, "succeeded").await;
    assert_eq!(job["attempt"], 2);
    assert_eq!(job["rounds"], 60);
    assert!(again.png(&id).await == undisturbed.png(&reference).await);
    assert!(!checkpoint.exists(), "a finished job needs no checkpoint");
}

#[tokio::test]
async fn a_job_that_takes_the_service_down_three_times_fails() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let id = server.submit(&endless()).await;
    server.wait_for_state(&id, "running").await;
    server.kill();
    for _ in 0..2 {
        let server = Server::start(data.path(), &[]);
        server.wait_for_state(&id, "running").await;
        server.kill();
    }
    let server = Server::start(data.path(), &[]);
    let job = server.wait_for_state(&id, "failed").await;
    assert_eq!(job["error"]["code"], "attempts_exhausted");
}

#[tokio::test]
async fn what_waited_and_what_was_done_survive_a_crash() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &["--concurrent", "1"]);
    let done = server.submit(&quick()).await;
    server.wait_for_state(&done, "succeeded").await;
    let running = server.submit(&endless()).await;
    let waiting = server.submit(&quick()).await;
    server.wait_for_state(&running, "running").await;
    let picture = server.png(&done).await;
    server.kill();

    let again = Server::start(data.path(), &["--concurrent", "2"]);
    assert!(again.png(&done).await == picture);
    again.wait_for_state(&waiting, "succeeded").await;
}

#[tokio::test]
async fn two_services_do_not_share_a_data_folder() {
    let data = tempfile::tempdir().unwrap();
    let _server = Server::start(data.path(), &[]);
    let second = std::process::Command::new(env!("CARGO_BIN_EXE_nephroid-api"))
        .args(["--listen", "127.0.0.1:0", "--data"])
        .arg(data.path())
        .output()
        .unwrap();
    assert_eq!(second.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&second.stderr).contains("another nephroid-api"));
}
