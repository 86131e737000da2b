fn main() { println!("{}", serde_json::to_string_pretty(&orthowear::scene::schema::json_schema()).unwrap()); }
