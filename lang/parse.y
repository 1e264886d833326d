// The shape of a scene: the grammar of the reference, section 3. What binds how strongly is said once, by the precedence
// declarations: a nonterminal for each level would say the same, but every number would be reduced through a dozen of them, which
// is most of the time of a parse. Brackets match already when they come here (filter.h). Forms of other languages that people
// bring along are parsed by productions of their own, marked "foreign".
%code requires {
#include "lang/parser.h"
}

%code {
#include "lang/diag.h"

static int scn_yylex(Value *value, Span *span, Parser *p);
static void scn_yyerror(Span *span, Parser *p, const char *message);

// Nested brackets are limited by the filter; this limits what nests without brackets, such as - - - x.
#define YYMAXDEPTH 10000
#define YYLLOC_DEFAULT(result, parts, count)                                          \
    do {                                                                              \
        if (count) {                                                                  \
            (result).begin = YYRHSLOC(parts, 1).begin;                                \
            (result).end = YYRHSLOC(parts, count).end;                                \
        } else {                                                                      \
            (result).begin = (result).end = YYRHSLOC(parts, 0).end;                   \
        }                                                                             \
    } while (0)
}

%define api.pure full
%define api.prefix {scn_yy}
%define api.token.prefix {TOK_}
%define api.value.type {Value}
%define api.location.type {Span}
%define parse.error custom
// Canonical tables, of 1,500 states, find an error at the very word, as a look ahead by simulation (parse.lac) does, which took a sixth of
// the time of a parse. Where only one reduction is possible it is made without reading on: an action sees the brackets that are
// open where its text ends.
%define lr.type canonical-lr
%define lr.default-reduction consistent
%locations
%expect 0
%param {Parser *p}

%initial-action { @$.begin = @$.end = p->source->base; }

%token <name> NAME SCN INCLUDE USE AS PARAM IN LET FN TAG TOOL FOR IF ELSE ASSERT PRINT NOT AND OR TRUE FALSE
%token <number> INT REAL
%token <color> COLOR
%token <text> STRING STRING_HEAD STRING_MIDDLE STRING_TAIL
%token BODY    // the { of an if or for
%token MISSING // for the name that is missing after a dot
%token RANGE ARROW EQ NE LE GE

%type <node> item parameter type result block body for expr operation call argument element if string inside alias
%type <node> head_in_parentheses
%type <list> items arguing parameters more_parameters arguments more_arguments parts exprs elements names pieces

// From the loosest to the tightest.
%left OR
%left AND
%precedence NOT
%left EQ NE '<' LE '>' GE // they do not chain; that they are written so is foreign
%nonassoc RANGE
%left '|'
%left '&'
%left '+' '-'
%left '*' '/' '%'
%precedence SIGN // - ~ before a value
%right '^'       // -x^2 is -(x^2), and 2^-x needs no parentheses
%precedence '.' '['

%%

file: items                                             { p->file = build_file(p, @$, $1); }
    ;

items: %empty                                           { $$ = list_of(NULL); }
    | items item                                        { $$ = list_add($1, $2); }
    ;

item: ';'                                               { $$ = NULL; }
    | SCN INT ';'                                       { $$ = build_version(p, @$, $2, @2); }
    | INCLUDE STRING ';'                                { $$ = build_include(p, @$, $2, @2); }
    | USE NAME alias ';'                                { $$ = build_use(p, @$, $2, (Text){0}, @2, $3, list_of(NULL)); }
    | USE NAME ':' names ';'                            { $$ = build_use(p, @$, $2, (Text){0}, @2, NULL, $4); }
    | USE STRING alias ';'                              { $$ = build_use(p, @$, NULL, $2, @2, $3, list_of(NULL)); }
    | USE STRING ':' names ';'                          { $$ = build_use(p, @$, NULL, $2, @2, NULL, $4); }
    | PARAM parameter ';'                               { $$ = build_param(p, @$, $2); }
    | FN NAME parameters result block                   { $$ = build_function(p, NODE_FN, @$, $2, @2, $3, $4, $5); }
    | TAG NAME parameters result block                  { $$ = build_function(p, NODE_TAG, @$, $2, @2, $3, $4, $5); }
    | TOOL NAME parameters block                        { $$ = build_function(p, NODE_TOOL, @$, $2, @2, $3, NULL, $4); }
    | expr ';'                                          { $$ = build_value(p, @$, $1); }
    | expr ':' expr ';'                                 { $$ = build_entry(p, @$, $1, $3, NULL, @2, list_of(NULL)); }
    | expr ':' expr NAME ';'                            { $$ = build_entry(p, @$, $1, $3, $4, @4, list_of(NULL)); }
    | expr ':' expr NAME arguing ';'                    { $$ = build_entry(p, @$, $1, $3, $4, @4, $5); }
    | expr ':' expr NAME '.' NAME ';'                   { $$ = build_entry_within(p, @$, $1, $3, $4, @4, $6, @6, list_of(NULL)); }
    | expr ':' expr NAME '.' NAME arguing ';'           { $$ = build_entry_within(p, @$, $1, $3, $4, @4, $6, @6, $7); }
    | LET NAME '=' expr ';'                             { $$ = build_let(p, @$, $2, @2, $4); }
    | LET NAME ':' type '=' expr ';'                    { $$ = build_typed_let(p, @$, $2, @2, $4, $6); } // foreign
    | NAME NAME '=' expr ';'                            { $$ = build_declaration(p, @$, $1, $2, @2, $4, false); }
    | NAME NAME block                                   { $$ = build_declaration(p, @$, $1, $2, @2, $3, true); }
    | operation '.' NAME NAME block                     { $$ = build_declaration_within(p, @$, $1, $3, @3, $4, @4, $5); }
    | NAME '=' expr ';'                                 { $$ = build_assignment(p, @$, $1, @1, @2, $3); } // foreign
    | for                                               { $$ = $1; }
    | ASSERT expr ';'                                   { $$ = build_assert(p, @$, $2, NULL); }
    | ASSERT expr ',' expr ';'                          { $$ = build_assert(p, @$, $2, $4); }
    | PRINT exprs ';'                                   { $$ = build_print(p, @$, $2); }
    | error ';'                                         { yyerrok; $$ = build_error(p, @$, NULL); }
    ;

alias: %empty                                           { $$ = NULL; }
    | AS NAME                                           { $$ = build_name(p, @2, $2); }
    ;

names: NAME                                             { $$ = list_of(build_name(p, @1, $1)); }
    | names ',' NAME                                    { $$ = list_add($1, build_name(p, @3, $3)); }
    ;

parameters: '(' ')'                                     { $$ = list_of(NULL); }
    | '(' more_parameters ')'                           { $$ = $2; }
    | '(' more_parameters ',' ')'                       { $$ = $2; }
    | '(' error ')'                                     { yyerrok; $$ = list_of(build_error(p, @$, NULL)); }
    ;

more_parameters: parameter                              { $$ = list_of($1); }
    | more_parameters ',' parameter                     { $$ = list_add($1, $3); }
    ;

parameter: NAME ':' type                                { $$ = build_parameter(p, @$, $1, @1, $3, NULL, NULL); }
    | NAME ':' type '=' expr                            { $$ = build_parameter(p, @$, $1, @1, $3, $5, NULL); }
    | NAME ':' type IN expr                             { $$ = build_parameter(p, @$, $1, @1, $3, NULL, $5); }
    | NAME ':' type '=' expr IN expr                    { $$ = build_parameter(p, @$, $1, @1, $3, $5, $7); }
    | NAME                                              { $$ = build_untyped(p, @$, $1, @1, NULL); } // foreign
    | NAME '=' expr                                     { $$ = build_untyped(p, @$, $1, @1, $3); } // foreign
    | NAME NAME                                         { $$ = build_type_first(p, @$, $1, @1, $2, @2); } // foreign
    ;

result: %empty                                          { $$ = NULL; }
    | ARROW type                                        { $$ = $2; }
    ;

type: NAME                                              { $$ = build_type(p, @$, $1, NULL); }
    | '[' type ']'                                      { $$ = build_type(p, @$, NULL, $2); }
    | '[' error ']'                                     { yyerrok; $$ = build_error(p, @$, NULL); }
    ;

block: '{' items '}'                                    { $$ = build_block(p, @$, $2); }
    ;

body: BODY items '}'                                    { $$ = build_block(p, @$, $2); }
    ;

for: FOR NAME IN expr body                              { $$ = build_for(p, @$, $2, @2, $4, $5); }
    | FOR head_in_parentheses body                      { $$ = build_for_with_head(p, @$, $2, $3); } // foreign
    ;

head_in_parentheses: '(' NAME IN expr ')'               { $$ = build_head_in_parentheses(p, @$, $2, @2, $4); }
    | '(' error ')'                                     { yyerrok; $$ = build_error(p, @$, NULL); }
    ;

expr: operation
    | expr OR expr                                      { $$ = build_binary(p, @$, NODE_OP_OR, @2, $1, $3); }
    | expr AND expr                                     { $$ = build_binary(p, @$, NODE_OP_AND, @2, $1, $3); }
    | NOT expr                                          { $$ = build_unary(p, @$, NODE_OP_NOT, @1, $2); }
    ;

operation: NAME                                         { $$ = build_name(p, @$, $1); }
    | NAME call                                         { $$ = build_call(p, @$, $1, @1, NULL, $2); }
    | INT                                               { $$ = build_number(p, @$, $1); }
    | REAL                                              { $$ = build_number(p, @$, $1); }
    | COLOR                                             { $$ = build_color(p, @$, $1); }
    | TRUE                                              { $$ = build_bool(p, @$, true); }
    | FALSE                                             { $$ = build_bool(p, @$, false); }
    | string
    | '(' expr ')'                                      { $$ = build_paren(p, @$, $2); }
    | '(' parts ')'                                     { $$ = build_vector(p, @$, $2); }
    | '(' parts ',' ')'                                 { $$ = build_vector(p, @$, $2); }
    | '(' error ')'                                     { yyerrok; $$ = build_error(p, @$, NULL); }
    | '[' ']'                                           { $$ = build_list(p, @$, list_of(NULL)); }
    | '[' elements ']'                                  { $$ = build_list(p, @$, $2); }
    | '[' elements ',' ']'                              { $$ = build_list(p, @$, $2); }
    | '[' error ']'                                     { yyerrok; $$ = build_error(p, @$, NULL); }
    | block
    | if
    | operation '.' NAME                                { $$ = build_member(p, @$, $1, $3, @3); }
    | operation '.' NAME call                           { $$ = build_call(p, @$, $3, @3, $1, $4); }
    | operation '.' MISSING                             { $$ = build_error(p, @$, $1); }
    | operation '.' MISSING call                        { $$ = build_error(p, @$, $1); }
    | operation '[' expr ']'                            { $$ = build_index(p, @$, $1, $3); }
    | operation '[' error ']'                           { yyerrok; $$ = build_index(p, @$, $1, build_error(p, @3, NULL)); }
    | '-' operation %prec SIGN                          { $$ = build_unary(p, @$, NODE_OP_NEG, @1, $2); }
    | '~' operation %prec SIGN                          { $$ = build_unary(p, @$, NODE_OP_COMPLEMENT, @1, $2); }
    | '!' operation %prec SIGN                          { $$ = build_foreign_not(p, @$, @1, $2); } // foreign, reported by the scanner
    | operation '^' operation                           { $$ = build_binary(p, @$, NODE_OP_POW, @2, $1, $3); }
    | operation '*' operation                           { $$ = build_binary(p, @$, NODE_OP_MUL, @2, $1, $3); }
    | operation '/' operation                           { $$ = build_binary(p, @$, NODE_OP_DIV, @2, $1, $3); }
    | operation '%' operation                           { $$ = build_modulo(p, @$, @2, $1, $3); } // foreign
    | operation '+' operation                           { $$ = build_binary(p, @$, NODE_OP_ADD, @2, $1, $3); }
    | operation '-' operation                           { $$ = build_binary(p, @$, NODE_OP_SUB, @2, $1, $3); }
    | operation '&' operation                           { $$ = build_binary(p, @$, NODE_OP_INTERSECT, @2, $1, $3); }
    | operation '|' operation                           { $$ = build_binary(p, @$, NODE_OP_UNION, @2, $1, $3); }
    | operation RANGE operation                         { $$ = build_binary(p, @$, NODE_OP_RANGE, @2, $1, $3); }
    | operation EQ operation                            { $$ = build_comparison(p, @$, NODE_OP_EQ, @2, $1, $3); }
    | operation NE operation                            { $$ = build_comparison(p, @$, NODE_OP_NE, @2, $1, $3); }
    | operation '<' operation                           { $$ = build_comparison(p, @$, NODE_OP_LT, @2, $1, $3); }
    | operation LE operation                            { $$ = build_comparison(p, @$, NODE_OP_LE, @2, $1, $3); }
    | operation '>' operation                           { $$ = build_comparison(p, @$, NODE_OP_GT, @2, $1, $3); }
    | operation GE operation                            { $$ = build_comparison(p, @$, NODE_OP_GE, @2, $1, $3); }
    ;

call: arguing                                           { $$ = build_arguments(p, @$, true, $1, NULL); }
    | arguing block                                     { $$ = build_arguments(p, @$, true, $1, $2); }
    | block                                             { $$ = build_arguments(p, @$, false, list_of(NULL), $1); }
    ;

// A bracket that is closed is reduced at once, whatever follows: recovery must not find it open on the stack.
arguing: '(' arguments ')'                              { $$ = $2; }
    | '(' error ')'                                     { yyerrok; $$ = list_of(build_error(p, @2, NULL)); }
    ;

arguments: %empty                                       { $$ = list_of(NULL); }
    | more_arguments                                    { $$ = $1; }
    | more_arguments ','                                { $$ = $1; }
    ;

more_arguments: argument                                { $$ = list_of($1); }
    | more_arguments ',' argument                       { $$ = list_add($1, $3); }
    ;

argument: expr
    | NAME ':' expr                                     { $$ = build_argument(p, @$, $1, @1, $3); }
    | NAME '=' expr                                     { $$ = build_named_with_equals(p, @$, $1, @1, @2, $3); } // foreign
    ;

parts: expr ',' expr                                    { $$ = list_add(list_of($1), $3); }
    | parts ',' expr                                    { $$ = list_add($1, $3); }
    ;

exprs: expr                                             { $$ = list_of($1); }
    | exprs ',' expr                                    { $$ = list_add($1, $3); }
    ;

elements: element                                       { $$ = list_of($1); }
    | elements ',' element                              { $$ = list_add($1, $3); }
    ;

element: expr
    | for
    ;

if: IF expr body                                        { $$ = build_if(p, @$, $2, $3, NULL); }
    | IF expr body ELSE block                           { $$ = build_if(p, @$, $2, $3, $5); }
    | IF expr body ELSE if                              { $$ = build_if(p, @$, $2, $3, $5); }
    ;

string: STRING                                          { $$ = build_string(p, @$, list_of(build_text(p, @1, $1))); }
    | pieces STRING_TAIL                                { $$ = build_string(p, @$, list_add($1, build_text(p, @2, $2))); }
    ;

pieces: STRING_HEAD inside                              { $$ = list_add(list_of(build_text(p, @1, $1)), $2); }
    | pieces STRING_MIDDLE inside                       { $$ = list_add(list_add($1, build_text(p, @2, $2)), $3); }
    ;

inside: expr
    | error                                             { $$ = build_error(p, @$, NULL); }
    ;

%%

static int scn_yylex(Value *value, Span *span, Parser *p)
{
    const Token *token = filter_next(&p->filter);
    *value = token->value;
    *span = token->span;
    return token->code;
}

// The parser's stack is full: things are nested without brackets, which the filter does not count.
static void scn_yyerror(Span *span, Parser *p, const char *message)
{
    if (!p->too_deep) {
        diag(p->unit, *span, DIAG_TOO_DEEP, "this is nested more than %d deep: give parts of it names with let", NODE_DEPTH_MAX);
    }
    p->too_deep = true;
}

// The token of a symbol that is one. Literal marks and named tokens alike.
static int code_of(yysymbol_kind_t symbol)
{
    for (int code = 0; code <= TOK_GE; code++) {
        if (YYTRANSLATE(code) == symbol && symbol != YYSYMBOL_YYUNDEF) return code;
    }
    return TOK_SCN_YYUNDEF;
}

static int yyreport_syntax_error(const yypcontext_t *context, Parser *p)
{
    enum { EXPECTED_MAX = 64 }; // the grammar has fewer tokens
    yysymbol_kind_t symbols[EXPECTED_MAX];
    int expected[EXPECTED_MAX];
    int count = yypcontext_expected_tokens(context, symbols, EXPECTED_MAX);
    for (int i = 0; i < count; i++) expected[i] = code_of(symbols[i]);
    Token found = {.code = code_of(yypcontext_token(context)), .span = *yypcontext_location(context)};
    report_unexpected(p, &found, expected, count > 0 ? count : 0);
    filter_recover(&p->filter);
    return 0;
}

Node *parse_source(Unit *unit, const Source *source)
{
    Parser p = {.unit = unit, .source = source};
    scanner_init(&p.scanner, unit, source);
    filter_init(&p.filter, unit, &p.scanner);
    bool whole = scn_yyparse(&p) == 0;
    if (!whole || !p.file || p.file->kind != NODE_FILE) { // given up: too deep
        Span all = {source->base, source->base + source->length};
        p.file = build_file(&p, all, list_of(build_error(&p, all, NULL)));
    }
    Node *file = p.file;
    scanner_release(&p.scanner);
    return file;
}
