//! A service that is killed again and again under load: nothing is lost, nothing is done twice, the bytes are the same.
//!
//! `make crash` kills it 200 times; by itself the test does so a few times.

use crate::server::{Server, quick, scene, until};
use serde_json::Value;
use std::collections::{HashMap, HashSet};
use std::path::Path;
use std::time::{Duration, Instant};

/// Scenes that differ in how long their phases take.
fn scenes() -> [Value; 3] {
    [quick(), scene([96, 72], 6), scene([200, 150], 3)]
}

/// Numbers that look random; the same on every run.
struct Dice(u64);

impl Dice {
    fn roll(&mut self, below: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % below
    }
}

fn start(data: &Path) -> Server {
    Server::start(data, &["--max-deaths", "1000000", "--queue", "100000", "--concurrent", "3"])
}

/// Submits, under names of its own, until the service is killed; a request whose answer did not come is sent again
/// the next time. Gives back what was acknowledged.
async fn submit_until(server: &Server, deadline: Instant, next: &mut usize) -> Vec<(String, usize)> {
    let mut acknowledged = Vec::new();
    while Instant::now() < deadline {
        let kind = *next % scenes().len();
        let request =
            server.client.post(server.url("/v1/renders")).header("content-type", "application/json");
        let request = request.header("idempotency-key", format!("request-{next}"));
        let Ok(answer) = request.body(scenes()[kind].to_string()).send().await else { continue };
        let Ok(job) = answer.json::<Value>().await else { continue };
        acknowledged.push((job["id"].as_str().unwrap().to_owned(), kind));
        *next += 1;
        // A few at a time: the load runs, and does not pile up.
        if acknowledged.len() >= 2 {
            tokio::time::sleep_until(deadline.into()).await;
        }
    }
    acknowledged
}

#[tokio::test]
async fn whatever_is_acknowledged_is_done_once_however_often_the_service_is_killed() {
    let kills: u64 = std::env::var("NEPHROID_TEST_KILLS").map_or(8, |text| text.parse().unwrap());
    let calm = tempfile::tempdir().unwrap();
    let undisturbed = Server::start(calm.path(), &[]);
    let mut references = Vec::new();
    for scene in scenes() {
        let id = undisturbed.submit(&scene).await;
        undisturbed.wait_for_state(&id, "succeeded").await;
        references.push(undisturbed.png(&id).await);
    }
    drop(undisturbed);

    let data = tempfile::tempdir().unwrap();
    let (mut dice, mut next, mut known) = (Dice(7), 0, HashMap::new());
    for _ in 0..kills {
        let server = start(data.path());
        // Any phase may be hit: the queue, the plan, photons, eye rays, encoding, between result and record.
        let life = Duration::from_millis(dice.roll(900));
        known.extend(submit_until(&server, Instant::now() + life, &mut next).await);
        server.kill();
    }
    let server = start(data.path());
    let mut attempts = 0;
    for (id, kind) in &known {
        let job = until(async || Some(server.job(id).await).filter(|job| job["done"] == true)).await;
        assert_eq!(job["state"], "succeeded", "{job:#}");
        attempts += job["attempt"].as_u64().unwrap();
        assert!(server.png(id).await == references[*kind], "{id}");
    }
    let all = every_job(&server).await;
    // One more than is known may be there: made by a request whose answer the kill cut off.
    assert!((known.len()..=known.len() + 1).contains(&all.len()), "{} of {}", known.len(), all.len());
    assert!(known.keys().all(|id| all.contains(id)));
    eprintln!("{kills} kills, {} jobs, {attempts} attempts", known.len());
}

async fn every_job(server: &Server) -> HashSet<String> {
    let (mut all, mut path) = (HashSet::new(), "/v1/renders?limit=100".to_owned());
    loop {
        let page = server.get_json(&path).await;
        for job in page["renders"].as_array().unwrap() {
            assert!(all.insert(job["id"].as_str().unwrap().to_owned()), "listed twice");
        }
        let Some(cursor) = page["next_cursor"].as_str() else { return all };
        path = format!("/v1/renders?limit=100&cursor={cursor}");
    }
}
