//! Why a route file cannot be used.

/// Why a route file cannot be used; lines count from 1.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DemandError {
    /// The text is no XML.
    #[error("{file}:{line}: no valid XML: {why}")]
    Xml {
        /// The file.
        file: String,
        /// The line.
        line: usize,
        /// What the reader of XML says.
        why: String,
    },
    /// The outermost element is another one.
    #[error("{file}: the outermost element is <{found}>; a route file has <routes>")]
    Root {
        /// The file.
        file: String,
        /// Its outermost element.
        found: String,
    },
    /// An element cannot be understood.
    #[error("{file}:{line}: {element}: {why}")]
    Element {
        /// The file.
        file: String,
        /// The line.
        line: usize,
        /// The element and its id, for example `vehicle "a7"`.
        element: String,
        /// What is wrong, and what to use instead.
        why: String,
    },
    /// An edge is not on the map.
    #[error(
        "{file}:{line}: {element}: unknown edge \"{edge}\": {why}; edges are named by netconvert \
         from the OpenDRIVE file of this map"
    )]
    UnknownEdge {
        /// The file.
        file: String,
        /// The line.
        line: usize,
        /// The element and its id.
        element: String,
        /// The edge.
        edge: String,
        /// What the map lacks.
        why: String,
    },
    /// An edge does not lead to the next one.
    #[error("{file}:{line}: {element}: no lane leads from edge \"{from}\" to edge \"{to}\"")]
    NotConnected {
        /// The file.
        file: String,
        /// The line.
        line: usize,
        /// The element and its id.
        element: String,
        /// The edge.
        from: String,
        /// The edge after it.
        to: String,
    },
}

/// Where an element stands, for errors.
#[derive(Clone, Debug)]
pub(crate) struct Place {
    pub(crate) file: String,
    pub(crate) line: usize,
    pub(crate) element: String,
}

impl Place {
    /// Returns an error about the element.
    pub(crate) fn error(&self, why: impl Into<String>) -> DemandError {
        let Place { file, line, element } = self.clone();
        DemandError::Element { file, line, element, why: why.into() }
    }
}
