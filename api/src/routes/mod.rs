//! Every address of the service, on one screen.

mod access;
mod assets;
mod events;
mod health;
mod page;
mod pictures;
mod plans;
mod renders;
mod scenes;

use crate::AppState;
use crate::openapi;
use crate::problem::Problem;
use crate::request::{answer_panic, cors, harden, observe};
use axum::Router;
use axum::middleware::{from_fn, from_fn_with_state};
use axum::routing::get;
use tower_http::catch_panic::CatchPanicLayer;
use utoipa::openapi::OpenApi;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

/// The service, without a listener.
pub fn router(state: AppState) -> Router {
    let cors = cors(&state.settings);
    let (described, _) = described().split_for_parts();
    described
        .route("/openapi.json", get(openapi::get_document))
        .route("/docs", get(page::docs))
        .route("/", get(page::index))
        .route("/{file}", get(page::file))
        .fallback(async || Problem::not_found("There is nothing at this address."))
        .method_not_allowed_fallback(async || Problem::method_not_allowed())
        .layer(CatchPanicLayer::custom(answer_panic))
        .layer(cors)
        .layer(from_fn(harden))
        .layer(from_fn_with_state(state.clone(), observe))
        .with_state(state)
}

/// The addresses for programs; what is said of them is written at their handlers.
fn described() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(routes!(renders::create_render, renders::list_renders))
        .routes(routes!(renders::get_render, renders::delete_render))
        .routes(routes!(renders::cancel_render))
        .routes(routes!(renders::get_render_scene))
        .routes(routes!(events::get_events))
        .routes(routes!(pictures::get_image_png))
        .routes(routes!(pictures::get_image_exr))
        .routes(routes!(pictures::get_preview))
        .routes(routes!(pictures::get_error_map))
        .routes(routes!(pictures::get_chart))
        .routes(routes!(pictures::get_layer))
        .routes(routes!(plans::create_plan))
        .routes(routes!(assets::put_asset, assets::get_asset))
        .routes(routes!(scenes::get_schema))
        .routes(routes!(scenes::list_scenes))
        .routes(routes!(scenes::get_scene))
        .routes(routes!(scenes::get_scene_picture))
        .routes(routes!(access::get_session, access::create_session, access::delete_session))
        .routes(routes!(health::live))
        .routes(routes!(health::ready))
        .routes(routes!(health::metrics))
}

/// What is said of the addresses.
pub(crate) fn description() -> OpenApi {
    described().into_openapi()
}
