//! The web page in a real browser.

use crate::server::{DEADLINE, Server, png_size, until};
use fantoccini::{Client, ClientBuilder, Locator};
use nephroid::develop::develop;
use nephroid::image_io::{self, ImageFormat};
use nephroid::scene::{ImageSettings, Tone};
use serde_json::{Value, json};
use std::path::Path;
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

async fn open_browser(driver: &Driver, profile: &Path, mut options: Value) -> Client {
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
    options["args"] = json!(arguments);
    let capabilities = json!({ "goog:chromeOptions": options });
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

/// Waits until a script gives something else than null or false.
async fn seen(browser: &Client, script: &str) -> Value {
    let wanted = |value: &Value| !value.is_null() && value != &json!(false);
    until(async || Some(run(browser, script).await).filter(wanted)).await
}

async fn click(browser: &Client, selector: &str) {
    let element = browser.wait().at_most(DEADLINE).for_element(Locator::Css(selector)).await.unwrap();
    element.click().await.unwrap();
}

/// Options of a browser that saves what it downloads here, and asks nobody.
fn saving_to(folder: &Path) -> Value {
    json!({ "prefs": { "download.default_directory": folder, "download.prompt_for_download": false } })
}

/// The file with this ending, once the browser has saved it: until then it has another name, or nothing in it.
async fn saved(folder: &Path, ending: &str) -> Vec<u8> {
    until(async || {
        let files = std::fs::read_dir(folder).unwrap().map(|file| file.unwrap().path());
        let file = files.into_iter().find(|file| file.extension().is_some_and(|end| end == ending));
        file.and_then(|file| std::fs::read(file).ok()).filter(|bytes| !bytes.is_empty())
    })
    .await
}

/// Presses keys wherever the focus is.
async fn press(browser: &Client, keys: &str) {
    browser.active_element().await.unwrap().send_keys(keys).await.unwrap();
}

/// Moves the focus on until it is there.
async fn tab_to(browser: &Client, selector: &str) {
    let there = format!("return document.activeElement.matches({selector:?})");
    for _ in 0..100 {
        press(browser, TAB).await;
        if run(browser, &there).await == json!(true) {
            return;
        }
    }
    panic!("{selector} cannot be reached by keyboard");
}

/// Puts the caret before this text, as a click there does.
async fn caret_before(browser: &Client, text: &str) {
    let script = format!(
        "const area = document.getElementById('scene'); area.focus();
         area.setSelectionRange(area.value.indexOf({text:?}), area.value.indexOf({text:?}))"
    );
    run(browser, &script).await;
}

/// Puts a text into the editor as if it had been typed.
async fn edit(browser: &Client, change: &str) {
    let script = format!(
        "const area = document.getElementById('scene'); area.value = ({change})(area.value);
         area.dispatchEvent(new Event('input'));"
    );
    run(browser, &script).await;
}

/// Makes the sample in the editor so small that a test need not wait.
async fn shrink(browser: &Client, [width, height]: [u32; 2], rounds: u32) {
    let change = format!(
        "(text) => {{ const scene = JSON.parse(text); Object.assign(scene.image, {{ width: {width}, height: {height} }});
         scene.render = {{ ...scene.render, stop: {{ rounds: {rounds} }} }}; return JSON.stringify(scene, null, 2); }}"
    );
    edit(browser, &change).await;
}

const TAB: &str = "\u{e004}";
const ENTER: &str = "\u{e007}";
const CTRL_ENTER: &str = "\u{e009}\u{e007}";
const BACKSPACE: &str = "\u{e003}";
const RIGHT: &str = "\u{e014}";

const SUCCEEDED: &str = "span#state[data-state=succeeded]";
/// The picture in the frame: its address and size.
const SHOWN: &str = "const image = document.getElementById('image');
    return !image.hidden && image.complete && image.naturalWidth ? [image.src, image.naturalWidth, image.naturalHeight] : null";

#[tokio::test]
async fn a_visitor_mends_a_scene_watches_it_and_takes_it_home() {
    let [data, profile, home] = [(); 3].map(|()| tempfile::tempdir().unwrap());
    let server = Server::start(data.path(), &[]);
    let driver = Driver::start();
    let browser = open_browser(&driver, profile.path(), saving_to(home.path())).await;
    browser.goto(&server.base).await.unwrap();
    click(&browser, "input[name=sample][value=glass-ball]").await;
    shrink(&browser, [160, 120], 64).await;
    // Highlights far above what a display shows, so that layers must be added before they are toned.
    let bright = "(text) => { const scene = JSON.parse(text); Object.assign(scene.image, { tone: 'filmic', exposure: 2 });
        return JSON.stringify(scene, null, 2); }";
    edit(&browser, bright).await;

    // A mistake is shown at its line while it is typed, and is selected when it is submitted.
    let mistake = "\"extra\": 1, ";
    caret_before(&browser, "\"radius\"").await;
    press(&browser, mistake).await;
    let marked =
        "const mark = document.querySelector('#gutter .wrong'); return mark && mark.textContent.trim()";
    let line = seen(&browser, marked).await;
    click(&browser, "#submit").await;
    let selected = "const area = document.getElementById('scene');
        const text = area.value.slice(area.selectionStart, area.selectionEnd);
        return text.includes('extra') && String(area.value.slice(0, area.selectionStart).split('\\n').length)";
    assert_eq!(seen(&browser, selected).await, line);
    assert_eq!(server.get_json("/v1/renders").await["renders"], json!([]));

    // Mended; the picture sharpens: previews after different numbers of rounds.
    caret_before(&browser, "\"radius\"").await;
    press(&browser, &BACKSPACE.repeat(mistake.len())).await;
    run(
        &browser,
        "window.rounds = new Set(); const image = document.getElementById('image');
        new MutationObserver(() => image.dataset.rounds && window.rounds.add(image.dataset.rounds))
            .observe(image, { attributes: true });",
    )
    .await;
    click(&browser, "#submit").await;
    browser.wait().at_most(DEADLINE).for_element(Locator::Css(SUCCEEDED)).await.unwrap();
    let previews = run(&browser, "return window.rounds.size").await;
    assert!(previews.as_u64() >= Some(3), "{previews} previews");
    assert!(
        run(&browser, "return document.querySelectorAll('#chart .dot').length").await.as_u64() >= Some(3)
    );
    assert!(
        run(&browser, "return document.querySelectorAll('#decisions tr').length").await.as_u64() >= Some(3)
    );
    let shown = seen(&browser, SHOWN).await;
    assert!(shown[0].as_str().unwrap().ends_with("/image.png") && shown[1] == 160, "{shown}");

    check_layers(&browser, &server).await;
    for id in ["download", "download-exr", "download-chart"] {
        click(&browser, &format!("#{id}")).await;
    }
    let id = run(&browser, "return location.hash.slice(1)").await;
    let png = saved(home.path(), "png").await;
    assert_eq!(png_size(&png), [160, 120]);
    assert!(png == server.png(id.as_str().unwrap()).await, "the file is the picture");
    assert!(image_io::decode(&saved(home.path(), "exr").await, ImageFormat::Exr).is_ok());
    assert!(String::from_utf8(saved(home.path(), "svg").await).unwrap().contains("<svg"));
    // The address of a job is enough to come back to it.
    browser.refresh().await.unwrap();
    browser.wait().at_most(DEADLINE).for_element(Locator::Css(SUCCEEDED)).await.unwrap();
    cancel_another(&browser, &server).await;
    browser.close().await.unwrap();
}

/// Switches layers off: without caustics the bright spot is gone, and what is left adds up as the service adds it.
async fn check_layers(browser: &Client, server: &Server) {
    click(browser, "#layers button[data-layer=caustic]").await;
    let without = seen(browser, &mixed("emitted and direct")).await;
    click(browser, "#layers button[data-layer=caustic]").await;
    click(browser, "#layers button[data-layer=emitted]").await;
    let with = seen(browser, &mixed("direct and caustic")).await;
    let expected =
        added(server, &run(browser, "return location.hash.slice(1)").await, ["direct", "caustic"]).await;
    let codes = |mixed: &Value| -> Vec<u8> { serde_json::from_value(mixed.clone()).unwrap() };
    let most = codes(&with).iter().zip(&expected).map(|(shown, right)| shown.abs_diff(*right)).max();
    assert!(most <= Some(1), "a code is off by {most:?}");
    let sum = |mixed: &Value| codes(mixed).into_iter().map(u64::from).sum::<u64>();
    assert!(sum(&with) > sum(&without), "caustics are light");
    click(browser, "#layers button[data-alone=error]").await;
    let map = "const image = document.getElementById('image');
        return !image.hidden && image.src.endsWith('/error.png') && image.naturalWidth === 160";
    seen(browser, map).await;
}

/// The codes of red, green and blue in the frame, once it shows the light of these layers.
fn mixed(layers: &str) -> String {
    format!(
        "const canvas = document.getElementById('mix');
        if (canvas.hidden || !canvas.getAttribute('aria-label').startsWith('{layers} light')) return null;
        const {{ data }} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
        return [...data].filter((_, i) => i % 4 !== 3)"
    )
}

/// Two layers of a job, added as light and then exposed and toned.
async fn added(server: &Server, id: &Value, names: [&str; 2]) -> Vec<u8> {
    let mut layers = Vec::new();
    for name in names {
        let path = format!("/v1/renders/{}/layers/{name}.exr", id.as_str().unwrap());
        let file = server.get(&path).await.bytes().await.unwrap();
        layers.push(image_io::decode(&file, ImageFormat::Exr).unwrap());
    }
    let (mut sum, other) = (layers.remove(0), layers.remove(0));
    let channels = sum.pixels.iter_mut().flatten();
    channels.zip(other.pixels.iter().flatten()).for_each(|(channel, more)| *channel += more);
    let brightest = sum.pixels.iter().flatten().copied().fold(0.0, f32::max);
    assert!(brightest * 4.0 > 2.0, "{brightest} is no highlight");
    let settings = ImageSettings { width: sum.width, height: sum.height, exposure: 2.0, tone: Tone::Filmic };
    develop(&sum, &settings)
}

/// Starts a job that would not end, and cancels it.
async fn cancel_another(browser: &Client, server: &Server) {
    click(browser, "input[name=sample][value=glass-ball]").await;
    shrink(browser, [160, 120], 1_000_000).await;
    click(browser, "#submit").await;
    browser.wait().at_most(DEADLINE).for_element(Locator::Css("#state[data-state=running]")).await.unwrap();
    click(browser, "#cancel").await;
    browser.wait().at_most(DEADLINE).for_element(Locator::Css("#state[data-state=cancelled]")).await.unwrap();
    let list = server.get_json("/v1/renders").await;
    assert_eq!(list["renders"][0]["state"], "cancelled");
    assert_eq!(list["renders"][1]["state"], "succeeded");
}

#[tokio::test]
async fn the_keyboard_is_enough() {
    let [data, profile, home] = [(); 3].map(|()| tempfile::tempdir().unwrap());
    let server = Server::start(data.path(), &[]);
    let driver = Driver::start();
    let browser = open_browser(&driver, profile.path(), saving_to(home.path())).await;
    browser.goto(&server.base).await.unwrap();
    let chosen = "return document.querySelector('input[name=sample]:checked')?.value";
    let first = seen(&browser, chosen).await;

    // Past the gallery into the editor, or through the gallery.
    tab_to(&browser, ".skip").await;
    press(&browser, ENTER).await;
    seen(&browser, "return document.activeElement.id === 'scene'").await;
    browser.refresh().await.unwrap();
    assert_eq!(seen(&browser, chosen).await, first);
    tab_to(&browser, "input[name=sample]").await;
    press(&browser, RIGHT).await;
    assert_ne!(run(&browser, chosen).await, first);
    tab_to(&browser, "#scene").await;
    mend_by_keyboard(&browser).await;

    // A layer off, the picture saved, another job stopped.
    tab_to(&browser, "button[data-layer=direct]").await;
    press(&browser, " ").await;
    seen(&browser, "return document.activeElement.getAttribute('aria-pressed') === 'false'").await;
    tab_to(&browser, "#download").await;
    press(&browser, ENTER).await;
    assert_eq!(png_size(&saved(home.path(), "png").await), [48, 36]);
    shrink(&browser, [160, 120], 1_000_000).await;
    caret_before(&browser, "{").await;
    press(&browser, CTRL_ENTER).await;
    browser.wait().at_most(DEADLINE).for_element(Locator::Css("#state[data-state=running]")).await.unwrap();
    tab_to(&browser, "#cancel").await;
    press(&browser, " ").await;
    browser.wait().at_most(DEADLINE).for_element(Locator::Css("#state[data-state=cancelled]")).await.unwrap();
    browser.close().await.unwrap();
}

/// In the editor: a mistake, the way to its line, mended, rendered.
async fn mend_by_keyboard(browser: &Client) {
    shrink(browser, [48, 36], 2).await;
    let mistake = "\"extra\": 1, ";
    caret_before(browser, "\"camera\"").await;
    press(browser, mistake).await;
    press(browser, CTRL_ENTER).await;
    seen(browser, "return !document.getElementById('problem').hidden").await;
    tab_to(browser, "button.jump").await;
    press(browser, ENTER).await;
    let line = "const area = document.getElementById('scene');
        return document.activeElement === area && area.value.slice(area.selectionStart, area.selectionEnd)";
    assert_eq!(seen(browser, line).await, "\"extra\"");
    caret_before(browser, "\"camera\"").await;
    press(browser, &BACKSPACE.repeat(mistake.len())).await;
    press(browser, CTRL_ENTER).await;
    browser.wait().at_most(DEADLINE).for_element(Locator::Css(SUCCEEDED)).await.unwrap();
}

#[tokio::test]
async fn the_editor_knows_what_may_come() {
    let (data, profile) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let server = Server::start(data.path(), &[]);
    let driver = Driver::start();
    let browser = open_browser(&driver, profile.path(), json!({})).await;
    browser.goto(&server.base).await.unwrap();
    seen(&browser, "return document.getElementById('scene').value.includes('glass')").await;
    shrink(&browser, [48, 36], 2).await;
    // A member of the first object, chosen from the list.
    run(
        &browser,
        "const area = document.getElementById('scene'); area.focus();
        const at = area.value.indexOf('{', area.value.indexOf('\"objects\"')) + 1;
        area.setRangeText(' , ', at, at, 'start'); area.setSelectionRange(at + 1, at + 1);",
    )
    .await;
    let scene = browser.find(Locator::Id("scene")).await.unwrap();
    let offered = "const list = document.getElementById('completions');
        return !list.hidden && [...list.querySelectorAll('.word')].map((word) => word.textContent)";
    let list = until(async || {
        scene.send_keys("\"vel").await.unwrap();
        let list = Some(run(&browser, offered).await).filter(Value::is_array);
        if list.is_none() {
            // The schema is not there yet: take it back.
            run(
                &browser,
                "const area = document.getElementById('scene');
                area.setRangeText('', area.selectionStart - 4, area.selectionStart, 'start');",
            )
            .await;
        }
        list
    })
    .await;
    assert_eq!(list, json!(["velocity"]));
    scene.send_keys("\u{e007}[0, 0, 0]").await.unwrap();
    let text = run(&browser, "return document.getElementById('scene').value").await;
    assert!(text.as_str().unwrap().contains("\"velocity\": [0, 0, 0],"), "{text}");
    scene.send_keys(CTRL_ENTER).await.unwrap();
    browser.wait().at_most(DEADLINE).for_element(Locator::Css(SUCCEEDED)).await.unwrap();
    browser.close().await.unwrap();
}

#[tokio::test]
async fn a_phone_shows_all_of_the_page_without_scrolling_aside() {
    let (data, profile) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let server = Server::start(data.path(), &[]);
    let driver = Driver::start();
    let phone =
        json!({ "mobileEmulation": { "deviceMetrics": { "width": 390, "height": 844, "pixelRatio": 2.0 } } });
    let browser = open_browser(&driver, profile.path(), phone).await;
    browser.goto(&server.base).await.unwrap();
    seen(&browser, "return document.getElementById('scene').value.includes('glass')").await;
    let wide = "return [...document.querySelectorAll('body *')].filter((element) => {
        const box = element.getBoundingClientRect();
        return box.width && box.right > 391 && !element.closest('.cards, .editor, .skip') && !element.ownerSVGElement;
    }).map((element) => element.outerHTML.slice(0, 80))";
    assert_eq!(run(&browser, wide).await, json!([]));
    assert_eq!(run(&browser, "return document.documentElement.scrollWidth").await, 390);
    browser.goto(&format!("{}/docs", server.base)).await.unwrap();
    seen(&browser, "return document.querySelectorAll('.operation').length > 15").await;
    browser.close().await.unwrap();
}
