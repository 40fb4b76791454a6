//! The web page in a real browser.

use crate::server::{DEADLINE, Server, until};
use fantoccini::{Client, ClientBuilder, Locator};
use serde_json::{Value, json};
use std::process::{Child, Command, Stdio};

/// A chromedriver on a free port; killed when dropped.
struct Driver {
    child: Child,
    url: String,
}

impl Driver {
    fn start() -> Self {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        drop(listener);
        let child = Command::new("chromedriver")
            .arg(format!("--port={port}"))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("chromedriver is installed: apt-get install -y chromium chromium-driver");
        Self { child, url: format!("http://127.0.0.1:{port}") }
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

async fn open_browser(driver: &Driver, profile: &std::path::Path) -> Client {
    let arguments = [
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--no-first-run",
        "--disable-dev-shm-usage",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        "--window-size=1280,1000",
        &format!("--user-data-dir={}", profile.display()),
    ];
    let capabilities = json!({ "goog:chromeOptions": { "args": arguments } });
    let Value::Object(capabilities) = capabilities else { unreachable!("an object was written") };
    // The driver takes a moment to listen.
    until(async || {
        let mut builder = ClientBuilder::new(hyper_util::client::legacy::connect::HttpConnector::new());
        builder.capabilities(capabilities.clone()).connect(&driver.url).await.ok()
    })
    .await
}

async fn run(browser: &Client, script: &str) -> Value {
    browser.execute(script, Vec::new()).await.unwrap()
}

#[tokio::test]
async fn a_visitor_renders_a_sample_and_sees_a_wrong_line() {
    let (data, profile) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let server = Server::start(data.path(), &[]);
    let driver = Driver::start();
    let browser = open_browser(&driver, profile.path()).await;
    browser.goto(&server.base).await.unwrap();

    let card = "input[name=sample][value=glass-ball]";
    let sample = browser.wait().at_most(DEADLINE).for_element(Locator::Css(card)).await.unwrap();
    sample.click().await.unwrap();
    // Small and short, so that the test is; the way is the same.
    run(
        &browser,
        "const area = document.getElementById('scene'); const scene = JSON.parse(area.value);
         Object.assign(scene.image, { width: 64, height: 48 }); scene.render.stop = { rounds: 3 };
         area.value = JSON.stringify(scene, null, 2); area.dispatchEvent(new Event('input'));",
    )
    .await;
    browser.find(Locator::Id("submit")).await.unwrap().click().await.unwrap();
    let state = "span#state[data-state=succeeded]";
    browser.wait().at_most(DEADLINE).for_element(Locator::Css(state)).await.unwrap();
    let shown = "const image = document.getElementById('image');
        return !image.hidden && image.src.endsWith('/image.png') ? [image.naturalWidth, image.naturalHeight] : null";
    let size = until(async || Some(run(&browser, shown).await).filter(|size| !size.is_null())).await;
    assert_eq!(size, json!([64, 48]));
    let download = browser.find(Locator::Id("download")).await.unwrap();
    let href = download.attr("href").await.unwrap().unwrap();
    assert_eq!(server.get(&href).await.headers()["content-type"], "image/png");

    run(
        &browser,
        "const area = document.getElementById('scene');
         area.value = area.value.replace('\"radius\"', '\"extra\": 1, \"radius\"'); area.dispatchEvent(new Event('input'));",
    )
    .await;
    browser.find(Locator::Id("submit")).await.unwrap().click().await.unwrap();
    let problem = "#problem:not([hidden]) code";
    browser.wait().at_most(DEADLINE).for_element(Locator::Css(problem)).await.unwrap();
    let selected = "const area = document.getElementById('scene');
        return area.value.slice(area.selectionStart, area.selectionEnd)";
    assert!(run(&browser, selected).await.as_str().unwrap().contains("extra"));
    browser.close().await.unwrap();
}
