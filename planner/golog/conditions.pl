:- module(planner_conditions,
          [ holds/2,                    % +Condition, +Situation
            asked/3,                    % +Condition, +Situation, -Answer
            satisfies/3,                % ?Vars, +Condition, +Situation
            closed/1,                   % +Condition
            number_of/3                 % +Term, -Number, +Situation
          ]).

/** <module> Conditions: what holds in a situation

The terms stand in planner_syntax. planner/checking/knowledge.py says the same in Python; it shares no code.
*/

:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(library(occurs), [sub_term/2]).
:- use_module(planner_golog(projection)).

%!  holds(+Condition, +Situation) is nondet.
%
%   Closed world: what is not known to hold does not. Unbound variables are existential; each
%   solution binds them.
%
%   @error depends_on_sensing(Location) looking ahead: only acting finds out

holds(all(Conditions), S) :- all_hold(Conditions, S).
holds(any(Conditions), S) :- member(Condition, Conditions), holds(Condition, S).
holds(not(Condition), S) :- \+ holds(Condition, S).
holds(holds(Property, Subject, Object), S) :- fluent_value(Property, Subject, Object, S).
holds(compare(Op, A, B), S) :- number_of(A, X, S), number_of(B, Y, S), compares(Op, X, Y).
holds(is_true(Location), S) :- truth(Location, S).
holds(some(Vars, Condition), S) :- \+ \+ satisfies(Vars, Condition, S).
holds(is_a(Individual, Class), S) :- member_of(Class, Individual, S).
holds(same(A, B), _) :- A = B.

all_hold([], _).
all_hold([Condition|Conditions], S) :-
    holds(Condition, S),
    all_hold(Conditions, S).

%!  number_of(+Term, -Number, +Situation) is nondet.
%
%   The numbers that one side of a comparison stands for.

number_of(Term, _, _) :- var(Term), !, fail.
number_of(value(Property, Subject), Number, S) :- !, fluent_value(Property, Subject, Number, S), number(Number).
number_of(plus(A, B), Number, S) :- !, number_of(A, X, S), number_of(B, Y, S), calculated(X + Y, Number).
number_of(minus(A, B), Number, S) :- !, number_of(A, X, S), number_of(B, Y, S), calculated(X - Y, Number).
number_of(times(A, B), Number, S) :- !, number_of(A, X, S), number_of(B, Y, S), calculated(X * Y, Number).
number_of(Number, Number, _) :- number(Number).

%   What is beyond all numbers is not known.
calculated(Expression, Number) :-
    catch(Number is Expression, error(evaluation_error(_), _), fail).

compares(less, X, Y) :- X < Y.
compares(at_most, X, Y) :- X =< Y.
compares(more, X, Y) :- X > Y.
compares(at_least, X, Y) :- X >= Y.
compares(equal, X, Y) :- X =:= Y.

truth(Location, S) :-
    (   known(Location, Value, S)
    ->  Value == true
    ;   ahead(S, _)
    ->  throw(error(depends_on_sensing(Location), _))
    ).

%!  asked(+Condition, +Situation, -Answer) is det.
%
%   Answer is `yes`, `no` or, looking ahead, unknown(Location): only acting finds out. Binds nothing.

asked(Condition, S, Answer) :-
    catch(( \+ holds(Condition, S) -> Answer = no ; Answer = yes ),
          error(depends_on_sensing(Location), _),
          Answer = unknown(Location)).

%!  satisfies(?Vars, +Condition, +Situation) is nondet.
%
%   Vars, each V-Class or V, have values of which Condition holds: individuals of Class, or what the
%   condition draws V from. Each part of the condition is asked as soon as its variables have values, so
%   that not(C) is about those values; what only acting finds out is asked last.
%
%   @error depends_on_sensing(Location)

satisfies(Vars, Condition, S) :-
    conjuncts(Condition, Cs, []),
    partition(found_out, Cs, Last, First),
    satisfied(First, Vars, S),
    maplist(is_of_class(S), Vars),
    \+ \+ all_hold(Last, S).

conjuncts(Condition, Cs, Rest) :-
    (   Condition = all(Parts) -> foldl(conjuncts, Parts, Cs, Rest) ; Cs = [Condition|Rest] ).

found_out(Condition) :-
    sub_term(T, Condition), nonvar(T), T = is_true(_), !.

satisfied(Cs, Vars, S) :-
    (   select(C, Cs, Rest), closed(C)
    ->  \+ \+ holds(C, S),
        satisfied(Rest, Vars, S)
    ;   select(C, Cs, Rest), C = holds(_, Subject, Value), ( nonvar(Subject) ; nonvar(Value) )
    ->  holds(C, S),
        satisfied(Rest, Vars, S)
    ;   member(Typed, Vars), nonvar(Typed), Typed = V-_, var(V)
    ->  is_of_class(S, Typed),
        satisfied(Cs, Vars, S)
    ;   ( select(C, Cs, Rest), draws(C) -> true ; Cs = [C|Rest] )
    ->  holds(C, S),
        satisfied(Rest, Vars, S)
    ;   true
    ).

draws(holds(_, _, _)).
draws(is_a(_, _)).

is_of_class(S, Typed) :-
    (   nonvar(Typed), Typed = X-Class -> member_of(Class, X, S) ; true ).

%!  closed(+Condition) is semidet.
%
%   It has no variable without a value, but those that some(Vars, C) in it gives values to.

closed(Condition) :-
    ( ground(Condition) -> true ; open_variables(Condition, []) ).

open_variables(some(Vars, C), Open) :- !,
    open_variables(C, Within),
    term_variables(Vars, Own),
    exclude(is_among(Own), Within, Open).
open_variables(all(Cs), Open) :- !, foldl(more_open, Cs, [], Open).
open_variables(any(Cs), Open) :- !, foldl(more_open, Cs, [], Open).
open_variables(not(C), Open) :- !, open_variables(C, Open).
open_variables(C, Open) :- term_variables(C, Open).

more_open(C, Open0, Open) :- open_variables(C, More), append(More, Open0, Open).

is_among(Vars, V) :- member(W, Vars), W == V, !.
