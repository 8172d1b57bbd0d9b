//! The files of the page. Nothing of it comes from elsewhere.

use axum::{
    body::Body,
    http::{Response, StatusCode, header},
};

const HTML: &str = "text/html; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";

/// Path, content type and content of each file.
const FILES: &[(&str, &str, &str)] = &[
    ("/", HTML, include_str!("../assets/index.html")),
    ("/view.css", CSS, include_str!("../assets/view.css")),
    ("/view.js", SCRIPT, include_str!("../assets/view.js")),
    ("/connection.js", SCRIPT, include_str!("../assets/connection.js")),
    ("/controls.js", SCRIPT, include_str!("../assets/controls.js")),
    ("/drive.js", SCRIPT, include_str!("../assets/drive.js")),
    ("/map.js", SCRIPT, include_str!("../assets/map.js")),
    ("/points.js", SCRIPT, include_str!("../assets/points.js")),
    ("/tiles.js", SCRIPT, include_str!("../assets/tiles.js")),
    ("/timeline.js", SCRIPT, include_str!("../assets/timeline.js")),
];

/// Scripts, styles and connections of this server only, and no frame of another page around it.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; \
                      img-src 'self' data:; frame-ancestors 'none'; base-uri 'none'";

/// Returns the file at a path, or an error page.
pub(crate) fn response(path: &str) -> Response<Body> {
    let Some((_, content_type, content)) = FILES.iter().find(|(name, ..)| *name == path) else {
        return text(StatusCode::NOT_FOUND, format!("there is no {path}; the page is /\n"));
    };
    Response::builder()
        .header(header::CONTENT_TYPE, *content_type)
        .header(header::CONTENT_SECURITY_POLICY, POLICY)
        .header(header::CACHE_CONTROL, "no-cache")
        .header(header::X_CONTENT_TYPE_OPTIONS, "nosniff")
        .body(Body::from(*content))
        .expect("constant headers are valid")
}

/// Returns a line of text with a status.
pub(crate) fn text(status: StatusCode, line: String) -> Response<Body> {
    let mut response = Response::new(Body::from(line));
    *response.status_mut() = status;
    response
}
