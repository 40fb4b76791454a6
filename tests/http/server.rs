//! What the tests share: a server of their own, a scene of a wanted cost, waiting with a deadline.

use reqwest::{Client, Response, StatusCode};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::Duration;

/// Longest time that anything may take: a guard against waiting for ever, not a bound on speed.
pub(crate) const DEADLINE: Duration = Duration::from_secs(600);

/// A running `nephroid-api`; killed when dropped.
pub(crate) struct Server {
    pub(crate) child: Child,
    pub(crate) base: String,
    pub(crate) client: Client,
}

impl Server {
    /// Starts the binary with its data in `data`.
    pub(crate) fn start(data: &Path, arguments: &[&str]) -> Self {
        Self::start_with(data, arguments, "warn", Stdio::inherit())
    }

    /// The same, with all that it says in a file.
    pub(crate) fn start_logged(data: &Path, arguments: &[&str], log: &Path) -> Self {
        Self::start_with(data, arguments, "info", std::fs::File::create(log).unwrap().into())
    }

    /// The same with so many files that it may open.
    pub(crate) fn start_with_files(data: &Path, arguments: &[&str], files: u32) -> Self {
        let mut shell = Command::new("sh");
        shell.args([
            "-c",
            &format!("ulimit -n {files}; exec \"$0\" \"$@\""),
            env!("CARGO_BIN_EXE_nephroid-api"),
        ]);
        Self::run(shell, data, arguments, "error", Stdio::inherit())
    }

    fn start_with(data: &Path, arguments: &[&str], filter: &str, log: Stdio) -> Self {
        Self::run(Command::new(env!("CARGO_BIN_EXE_nephroid-api")), data, arguments, filter, log)
    }

    fn run(mut command: Command, data: &Path, arguments: &[&str], filter: &str, log: Stdio) -> Self {
        let mut child = command
            .args(["serve", "--listen", "127.0.0.1:0", "--data"])
            .arg(data)
            .args(arguments)
            .env("NEPHROID_LOG", filter)
            .stdout(Stdio::piped())
            .stderr(log)
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let base =
            line.trim().strip_prefix("listening on ").expect("the first line is the address").to_owned();
        Self { child, base, client: Client::new() }
    }

    pub(crate) fn url(&self, path: &str) -> String {
        format!("{}{path}", self.base)
    }

    pub(crate) async fn get(&self, path: &str) -> Response {
        self.client.get(self.url(path)).send().await.unwrap()
    }

    pub(crate) async fn get_json(&self, path: &str) -> Value {
        self.get(path).await.json().await.unwrap()
    }

    pub(crate) async fn post(&self, path: &str, body: impl Into<reqwest::Body>) -> Response {
        let request = self.client.post(self.url(path)).header("content-type", "application/json");
        request.body(body).send().await.unwrap()
    }

    /// Submits a scene; its id.
    pub(crate) async fn submit(&self, scene: &Value) -> String {
        let answer = self.post("/v1/renders", scene.to_string()).await;
        assert_eq!(answer.status(), StatusCode::ACCEPTED);
        let job: Value = answer.json().await.unwrap();
        job["id"].as_str().unwrap().to_owned()
    }

    pub(crate) async fn job(&self, id: &str) -> Value {
        self.get_json(&format!("/v1/renders/{id}")).await
    }

    /// Waits until the job is as wanted.
    pub(crate) async fn wait_for(&self, id: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        let mut last = Value::Null;
        let looking = until_or_none(async || {
            last = self.job(id).await;
            wanted(&last).then_some(())
        });
        assert!(looking.await.is_some(), "it happens before the deadline; {last:#}");
        last
    }

    pub(crate) async fn wait_for_state(&self, id: &str, state: &str) -> Value {
        let job = self.wait_for(id, |job| job["done"] == true || job["state"] == state).await;
        assert_eq!(job["state"], state, "{job:#}");
        job
    }

    pub(crate) async fn png(&self, id: &str) -> Vec<u8> {
        let answer = self.get(&format!("/v1/renders/{id}/image.png")).await;
        assert_eq!(answer.status(), StatusCode::OK);
        answer.bytes().await.unwrap().to_vec()
    }

    /// Ends the process as `kill -9` does.
    pub(crate) fn kill(mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// Asks the process to end, and waits until it has.
    pub(crate) async fn terminate(mut self) -> ExitStatus {
        let id = rustix::process::Pid::from_child(&self.child);
        rustix::process::kill_process(id, rustix::process::Signal::TERM).unwrap();
        until(async || self.child.try_wait().unwrap()).await
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // Fails if it has ended already, which is as good.
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

/// Looks again and again until there is an answer.
pub(crate) async fn until<T>(look: impl AsyncFnMut() -> Option<T>) -> T {
    until_or_none(look).await.expect("it happens before the deadline")
}

async fn until_or_none<T>(mut look: impl AsyncFnMut() -> Option<T>) -> Option<T> {
    let mut ticks = tokio::time::interval(Duration::from_millis(20));
    let looking = async {
        loop {
            ticks.tick().await;
            if let Some(found) = look().await {
                return found;
            }
        }
    };
    tokio::time::timeout(DEADLINE, looking).await.ok()
}

/// A glass ball over a floor, rendered for so many rounds.
pub(crate) fn scene([width, height]: [u32; 2], rounds: u32) -> Value {
    json!({
        "nephroid": 1,
        "name": "ball",
        "image": { "width": width, "height": height },
        "camera": { "type": "perspective", "eye": [0, 2.4, 4.2], "target": [-0.3, 0.2, 0], "fov": 36 },
        "materials": {
            "floor": { "type": "diffuse", "albedo": [0.7, 0.7, 0.7] },
            "glass": { "type": "glass", "ior": 1.5 }
        },
        "objects": [
            { "name": "floor", "type": "polygon", "material": "floor",
              "vertices": [[-3, 0, 3], [3, 0, 3], [3, 0, -3], [-3, 0, -3]] },
            { "name": "ball", "type": "sphere", "center": [0, 0.55, 0], "radius": 0.5, "material": "glass" }
        ],
        "lights": [
            { "type": "quad", "center": [1.2, 3.0, 0.6], "size": [0.2, 0.2], "towards": [0, 0.55, 0],
              "radiance": [120, 120, 120] }
        ],
        "render": { "stop": { "rounds": rounds } }
    })
}

/// A scene that does not end while a test looks.
pub(crate) fn endless() -> Value {
    scene([320, 240], 1_000_000)
}

/// A scene that is soon done.
pub(crate) fn quick() -> Value {
    scene([48, 36], 2)
}

/// Width and height as a PNG says them.
pub(crate) fn png_size(png: &[u8]) -> [u32; 2] {
    assert_eq!(&png[..8], b"\x89PNG\r\n\x1a\n");
    [16, 20].map(|at| u32::from_be_bytes(png[at..at + 4].try_into().unwrap()))
}
