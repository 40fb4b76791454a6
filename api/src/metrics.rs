//! What the service counts, for Prometheus.

use crate::engine::Work;
use prometheus_client::encoding::text::encode;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::{Histogram, exponential_buckets};
use prometheus_client::registry::Registry;
use std::fmt;
use std::sync::atomic::AtomicU64;
use std::time::Duration;

/// The type of what [`Metrics::text`] gives.
pub(crate) const CONTENT_TYPE: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// Names and values.
type Labels<const N: usize> = [(&'static str, String); N];

/// Everything that is counted.
#[derive(Debug)]
pub struct Metrics {
    registry: Registry,
    requests: Family<Labels<3>, Counter>,
    request_seconds: Histogram,
    problems: Family<Labels<1>, Counter>,
    jobs: Family<Labels<1>, Counter>,
    failures: Family<Labels<1>, Counter>,
    job_seconds: Histogram,
    pass_seconds: Family<Labels<1>, Counter<f64, AtomicU64>>,
    photons: Counter,
    rays: Counter,
    queued: Gauge,
    running: Gauge,
}

impl Default for Metrics {
    fn default() -> Self {
        let mut metrics = Self {
            registry: Registry::with_prefix("nephroid"),
            requests: Family::default(),
            request_seconds: Histogram::new(exponential_buckets(0.000_25, 4.0, 10)),
            problems: Family::default(),
            jobs: Family::default(),
            failures: Family::default(),
            job_seconds: Histogram::new(exponential_buckets(0.01, 3.0, 12)),
            pass_seconds: Family::default(),
            photons: Counter::default(),
            rays: Counter::default(),
            queued: Gauge::default(),
            running: Gauge::default(),
        };
        metrics.register();
        metrics
    }
}

impl Metrics {
    fn register(&mut self) {
        let registry = &mut self.registry;
        registry.register("requests", "Requests by method, route and status", self.requests.clone());
        registry.register("request_seconds", "Time to answer a request", self.request_seconds.clone());
        registry.register("problems", "Answers that are problems, by code", self.problems.clone());
        registry.register("jobs", "Jobs by what became of them", self.jobs.clone());
        registry.register("job_failures", "Failed jobs by code", self.failures.clone());
        registry.register("job_seconds", "Time from the start of a job to its end", self.job_seconds.clone());
        registry.register("pass_seconds", "Seconds of rendering, by pass", self.pass_seconds.clone());
        registry.register("photons", "Photons sent", self.photons.clone());
        registry.register("rays", "Rays traced, of photons and of the eye", self.rays.clone());
        registry.register("jobs_queued", "Jobs that wait", self.queued.clone());
        registry.register("jobs_running", "Jobs that are being rendered", self.running.clone());
    }

    /// A request was answered; `route` is the pattern of its address.
    pub(crate) fn answered(&self, [method, route]: [&str; 2], status: u16, took: Duration) {
        let labels = [("method", method.into()), ("route", route.into()), ("status", status.to_string())];
        self.requests.get_or_create(&labels).inc();
        self.request_seconds.observe(took.as_secs_f64());
    }

    /// The answer was a problem of this code.
    pub(crate) fn refused(&self, code: &'static str) {
        self.problems.get_or_create(&[("code", code.into())]).inc();
    }

    /// A job has come to its end, or has come in: `accepted`, `succeeded`, `failed`, `cancelled`.
    pub(crate) fn job(&self, what: &'static str) {
        self.jobs.get_or_create(&[("event", what.into())]).inc();
    }

    /// A job has ended after this time, with the code of its failure if it failed.
    pub(crate) fn job_ended(&self, failure: Option<&str>, took: Duration) {
        self.job_seconds.observe(took.as_secs_f64());
        self.job(if failure.is_some() { "failed" } else { "succeeded" });
        if let Some(code) = failure {
            self.failures.get_or_create(&[("code", code.into())]).inc();
        }
    }

    /// A turn of rendering was made.
    pub(crate) fn worked(&self, before: Work, after: Work) {
        self.photons.inc_by(after.photons.saturating_sub(before.photons));
        self.rays.inc_by(after.rays.saturating_sub(before.rays));
        for (pass, seconds) in
            ["light", "eye"].into_iter().zip(after.pass_seconds.into_iter().zip(before.pass_seconds))
        {
            let seconds = (seconds.0 - seconds.1).max(0.0);
            self.pass_seconds.get_or_create(&[("pass", pass.into())]).inc_by(seconds);
        }
    }

    /// All of it as text, with how many jobs wait and run just now.
    pub(crate) fn text(&self, (queued, running): (u32, u32)) -> Result<String, fmt::Error> {
        self.queued.set(queued.into());
        self.running.set(running.into());
        let mut text = String::new();
        encode(&mut text, &self.registry)?;
        Ok(text)
    }
}
