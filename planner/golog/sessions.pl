:- module(planner_sessions,
          [ keep/3,                     % +Session, +Program, +Situation
            kept/3,                     % +Session, -Program, -Situation
            keep_ahead/3,               % +Session, +Program, +Situation
            ahead_of/3,                 % +Session, -Program, -Situation
            keep_network/2,             % +Session, +Network
            kept_network/2,             % +Session, -Network
            keep_planned/3,             % +Session, +Guide, +Waits
            take_planned/4,             % +Session, -Guide, -Waits, -Open
            forget_session/1,           % +Session
            action_row/4                % +Id, +Head, +Agents, -Row
          ]).

/** <module> What is kept of each request between calls

Sessions are kept in the recorded database, which all threads share. Under the key of a session stand
    kept(Program, Situation)         what remains to be done, for real
    ahead(Program, Situation)        the same as it is looked ahead from
    network(Network)                 what it may come to from there, once that has been asked for
    planned(Guide, Waits, Open)      from when a plan is found until it is adopted; Open are the steps of the
                                     plan before that had not begun when it was found
*/

:- use_module(library(apply)).
:- use_module(planner_golog(guide)).
:- use_module(planner_golog(projection)).

keep(Session, P, S) :-
    forget(Session, kept(_, _)),
    recorda(Session, kept(P, S)).

%!  kept(+Session, -Program, -Situation) is det.
%
%   @error existence_error(session, Session)

kept(Session, P, S) :-
    (   recorded(Session, kept(P0, S0))
    ->  P = P0, S = S0
    ;   throw(error(existence_error(session, Session), _))
    ).

keep_ahead(Session, P, S) :-
    forget(Session, ahead(_, _)),
    forget(Session, network(_)),
    recorda(Session, ahead(P, S)).

keep_network(Session, Network) :-
    recorda(Session, network(Network)).

kept_network(Session, Network) :-
    recorded(Session, network(Kept)), !,
    Network = Kept.

ahead_of(Session, P, S) :-
    once(recorded(Session, ahead(P, S))).

keep_planned(Session, Guide, Waits) :-
    kept(Session, _, S),
    ( guide_of(S, Old) -> open_steps(Old, Open) ; Open = [] ),
    forget(Session, planned(_, _, _)),
    recorda(Session, planned(Guide, Waits, Open)).

%!  take_planned(+Session, -Guide, -Waits, -Open) is semidet.

take_planned(Session, Guide, Waits, Open) :-
    recorded(Session, planned(Guide, Waits, Open), Reference), !,
    erase(Reference).

forget_session(Session) :-
    forget(Session, _).

forget(Session, What) :-
    forall(recorded(Session, What, Reference), erase(Reference)).

%!  action_row(+Id, +Head, +Agents, -Row) is det.
%
%   Rows, not dicts, as 300 of them a second go over to Python: names of parameters are known there.

action_row(Id, Head, Agents, [Id, Agents, Name|Values]) :-
    (   atom(Head)
    ->  Name = Head, Values = []
    ;   compound_name_arguments(Head, Name, Arguments),
        maplist(value_row, Arguments, Values)
    ).

%   An individual is its name; data are told by where they are.
value_row(Value, Row) :-
    (   atomic(Value)
    ->  Row = Value
    ;   Value = loc(Frame, Name)
    ->  atomic_list_concat([Frame, /, Name], Place),
        Row = [Place]
    ;   Value = fluent(Property, Subject)
    ->  Row = [Property, Subject]
    ).
