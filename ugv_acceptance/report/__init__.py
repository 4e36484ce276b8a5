"""Pages and pictures of results: self-contained HTML, figures as SVG."""
