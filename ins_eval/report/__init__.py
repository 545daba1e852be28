"""From numbers to a page: figures, words and tables, as HTML and as plain text.

`figures` draws from plain arrays and from results; `flight` and `evaluation` put metrics into words (`content`);
`page` and `text` render the same sections twice. Nothing here knows how the numbers were made.
"""
